"""Run the code that `compiler.py` generates. No other pipros module executes generated code.

Every name in that code has been checked against the grammar of definitions, and all other text from a
definition has been passed through `repr`.
"""

from __future__ import annotations

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` takes milliseconds
if TYPE_CHECKING:
    from types import CodeType
    from typing import Any


def run(code: CodeType | str, namespace: dict[str, Any], file: str = "<message>") -> dict[str, Any]:
    """Run a generated module in `namespace`, which contains the embedded classes by name.

    Args:
        code: compiled code, or source.
        file: the file name to show in tracebacks.

    Returns:
        The namespace, which now includes the names that the module defines.
    """
    exec(compile(code, file, "exec") if isinstance(code, str) else code, namespace)  # noqa: S102
    return namespace
