"""Read parameters by the rules of roscpp, with defaults that also apply if the master does not answer."""

from __future__ import annotations

import math
from typing import Any, TypeVar

from pipros.basics.errors import PiprosError
from pipros.node.node import Node

_INT = 2**31

Value = TypeVar("Value")


def raw(node: Node, name: str, default: Any = None) -> Any:
    """Return a private parameter of any type, or `default` if it is not set."""
    try:
        return node.params.get(f"~{name}")
    except (LookupError, PiprosError):
        return default


def private(node: Node, name: str, default: Value) -> Value:
    """Return a private parameter in the type of `default`; see `read`."""
    return read(raw(node, name), default)


def number(node: Node, name: str, default: float) -> float:
    """Return a private parameter if it is a finite number, otherwise `default`."""
    value = private(node, name, float(default))
    return value if math.isfinite(value) else default


def read(value: Any, default: Value) -> Value:
    """Return a parameter in the type of `default`, or `default` if roscpp does not convert it."""
    found: Any = converted(value, type(default))
    return default if found is None else found


def converted(value: Any, kind: type) -> Any:
    """Convert a parameter as roscpp's `param` does. Return None if it has another type.

    Only numbers are converted: an integer to a float, and a float to the next integer if its fraction is at
    least a half, otherwise (also if it is negative) to the integer below. If that is not an integer of 32
    bits, the result is None; in roscpp, it is the smallest one.
    """
    if kind is bool or kind is str:
        return value if isinstance(value, kind) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    if kind is float:
        return kind(value)
    if not math.isfinite(value):
        return None
    whole = math.floor(value + 0.5 if value > 0 else value)
    return kind(whole) if -_INT <= whole < _INT else None


def converted_list(value: Any, kind: type) -> list[Any] | None:
    """Convert a list as roscpp's `param` does. Return None if the value is not a list, or an element differs.

    Numbers and bools are converted into each other; the fraction of a number is dropped.
    """
    if not isinstance(value, list):
        return None
    if kind is str:
        return value if all(isinstance(each, str) for each in value) else None
    if not all(isinstance(each, int | float) for each in value):
        return None
    try:
        return [kind(each) for each in value]
    except (ValueError, OverflowError):  # an infinite float is not an integer
        return None
