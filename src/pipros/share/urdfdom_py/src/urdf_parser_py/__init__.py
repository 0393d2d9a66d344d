"""Found only where the real urdf_parser_py is not installed."""

from pipros.basics.extras import install_command

raise ModuleNotFoundError(
    f"urdf_parser_py is not installed. It comes from PyPI: {install_command('urdf')}", name="urdf_parser_py"
)
