"""Imported only if xacro is not installed: raises an error that says how to install it."""

from pipros.basics.extras import install_command

raise ModuleNotFoundError(
    f"xacro is not installed. It comes from PyPI: {install_command('urdf')}", name="xacro"
)
