"""Private parameters and timestamps for the teleoperation programs."""

from __future__ import annotations

from math import isfinite
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node


def private(node: Node, name: str, usual: Any) -> Any:
    """Return a private parameter, or `usual` if it is not set or the master does not respond."""
    try:
        return node.params.get(f"~{name}")
    except (LookupError, PiprosError):
        return usual


def number(node: Node, name: str, usual: float) -> float:
    """Return a private parameter if it is a finite number, otherwise `usual`."""
    value = private(node, name, usual)
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
    return float(value) if is_number else usual


def stamp(node: Node) -> Time:
    """Return the node's current time as a header timestamp."""
    return Time(*divmod(node.clock.now_ns(), NS_PER_S))
