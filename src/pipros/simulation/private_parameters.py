"""Read the private parameters of a node, with defaults."""

from __future__ import annotations

import math
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.node import Node


class InvalidPrivateParameter(PiprosError, ValueError):
    """A parameter has an invalid value. The error text names the parameter and its value."""


def private_value(node: Node, name: str, default: Any) -> Any:
    """Return the parameter `~name`, or the default if it is not set."""
    try:
        return node.params.get(f"~{name}")
    except LookupError:
        return default


def private_text(node: Node, name: str, default: str) -> str:
    """Return the frame ID in a parameter, without a leading slash, or `default` if it is not set.

    Raises:
        InvalidPrivateParameter: the value is not a string.
    """
    value = private_value(node, name, default)
    if not isinstance(value, str):
        raise InvalidPrivateParameter(f"~{name} must be a string, got {value!r}")
    return value.lstrip("/")


def private_number(node: Node, name: str, default: float) -> float:
    """Return the finite number in a parameter, or `default` if the parameter is not set.

    Raises:
        InvalidPrivateParameter: the value is not a finite number.
    """
    value = private_value(node, name, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InvalidPrivateParameter(f"~{name} must be a finite number, got {value!r}")
    return float(value)
