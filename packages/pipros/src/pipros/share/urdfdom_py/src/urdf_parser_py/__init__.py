"""Imported only if urdf_parser_py is not installed: raises an error that says how to install it."""

from pipros.basics.extras import install_command

raise ModuleNotFoundError(
    f"urdf_parser_py is not installed. It comes from PyPI: {install_command('urdf')}", name="urdf_parser_py"
)
