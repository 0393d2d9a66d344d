"""Found only where the real urdf_parser_py is not installed."""

raise ModuleNotFoundError(
    "urdf_parser_py is not installed. It comes from PyPI: pip install 'pipros[urdf]'", name="urdf_parser_py"
)
