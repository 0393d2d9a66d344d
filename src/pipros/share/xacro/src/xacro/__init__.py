"""Found only where the real xacro is not installed."""

from pipros.basics.extras import install_command

raise ModuleNotFoundError(
    f"xacro is not installed. It comes from PyPI: {install_command('urdf')}", name="xacro"
)
