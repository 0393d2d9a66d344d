"""Read nodes' private parameters, with defaults that also apply if the master does not answer."""

from __future__ import annotations

from math import isfinite
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.node.node import Node


def raw(node: Node, name: str, default: Any = None) -> Any:
    """Return a private parameter of any type, or `default` if it is not set."""
    try:
        return node.params.get(f"~{name}")
    except (LookupError, PiprosError):
        return default


def private(node: Node, name: str, default: Any) -> Any:
    """Return a private parameter if it has the type of `default`, otherwise `default`, as roscpp does.

    An integer is also accepted for a float.
    """
    value = raw(node, name)
    if isinstance(default, float) and type(value) is int:
        return float(value)
    return value if type(value) is type(default) else default


def number(node: Node, name: str, default: float) -> float:
    """Return a private parameter if it is a finite number, otherwise `default`."""
    value = private(node, name, float(default))
    return value if isfinite(value) else default
