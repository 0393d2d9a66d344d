"""Runs the code that `compiler.py` generates: the only place in pipros where text becomes code.

Every name in that code was checked against the grammar of definitions, and all other text from a definition
went through `repr`.
"""

from __future__ import annotations

TYPE_CHECKING = False  # true for type checkers; every first import of a message imports this module
if TYPE_CHECKING:
    from types import CodeType
    from typing import Any


def run(code: CodeType | str, namespace: dict[str, Any], file: str = "<message>") -> dict[str, Any]:
    """Runs a generated module in `namespace`, which holds the embedded classes by their names.

    Args:
        code: compiled code, or source.
        file: the name of the source in tracebacks.

    Returns:
        The namespace, now with the names that the module defines.
    """
    exec(compile(code, file, "exec") if isinstance(code, str) else code, namespace)  # noqa: S102
    return namespace
