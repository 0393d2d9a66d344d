"""Private parameters of nodes, typed as in roscpp: a value of another type counts as missing."""

from __future__ import annotations

from typing import Any

from pipros.basics.errors import PiprosError
from pipros.node import Node


def private(node: Node, name: str, default: Any) -> Any:
    """Return a private parameter if it has the type of `default`, otherwise `default`.

    An integer is also accepted for a float.
    """
    try:
        value = node.params.get(f"~{name}")
    except (LookupError, PiprosError):
        return default
    if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return value if type(value) is type(default) else default


def raw(node: Node, name: str) -> Any:
    """Return a private parameter of any type; None if it is not set."""
    try:
        return node.params.get(f"~{name}")
    except (LookupError, PiprosError):
        return None
