"""Found only where the real xacro is not installed."""

raise ModuleNotFoundError(
    "xacro is not installed. It comes from PyPI: pip install 'pipros[urdf]'", name="xacro"
)
