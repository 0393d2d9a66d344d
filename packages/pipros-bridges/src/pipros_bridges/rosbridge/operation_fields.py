"""Read the fields of a client's operations, and count the memory for the names and ids in them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable

ID_CHARACTERS = 1_000
"""Maximum length of an id, as JSON, that the server keeps."""
_NAME_BYTES = 1_000
_ID_BYTES = 200
"""Approximate memory for a topic or service (`_NAME_BYTES`) and for an id, besides their characters."""


class BadOperation(PiprosError):
    """A client's operation lacks a value, has an invalid value, or is not allowed."""


def key_of(operation: Mapping[str, Any]) -> str:
    """Convert an operation's id, which can be of any type, to a dictionary key."""
    identity = operation.get("id")
    key = "null" if identity is None else json.dumps(identity, default=str, sort_keys=True)
    if len(key) > ID_CHARACTERS:
        raise BadOperation(f"id must have at most {ID_CHARACTERS} characters, got {len(key)}")
    return key


def cost_of_id(key: str) -> int:
    """Return the approximate memory for an id."""
    return len(key) + _ID_BYTES


def cost_of_name(name: str) -> int:
    """Return the approximate memory for a topic or a service."""
    return 4 * len(name) + _NAME_BYTES


def type_in(operation: Mapping[str, Any]) -> str:
    """Return the field `type` as `package/Name`; accept names of ROS 2, such as `std_msgs/msg/String`."""
    kind = operation.get("type")
    text = kind if isinstance(kind, str) and len(kind) <= ID_CHARACTERS else ""
    parts = [part for part in text.split("/") if part]
    if len(parts) < 2:
        raise BadOperation(f"type must be package/Name, got {quoted(kind)}")
    package, *_, name = parts
    return f"{package}/{name}"


def number_in(operation: Mapping[str, Any], key: str, default: int = 0, *, least: float = 0) -> float:
    """Return a field that must be a finite number >= `least`, or the default if the field is missing or null.

    Numbers beyond ±2**31 are replaced by this limit.
    """
    value = operation.get(key)
    if value is None:
        return default
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value < math.inf:
        rule = "a finite number >= 0" if least == 0 else "a finite number"
        raise BadOperation(f"{key} must be {rule}, got {quoted(value)}")
    return max(min(value, 2**31), -(2**31))


def flag_in(operation: Mapping[str, Any], key: str) -> bool | None:
    """Return a field that must be true, false, null or missing."""
    value = operation.get(key)
    if value is not None and not isinstance(value, bool):
        raise BadOperation(f"{key} must be true or false, got {quoted(value)}")
    return value


def quoted(value: object) -> str:
    """Return a value for an error text."""
    return printable(repr(value), 100) if value is not None else "null"
