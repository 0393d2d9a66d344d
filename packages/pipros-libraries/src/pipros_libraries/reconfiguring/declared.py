"""Declare parameters that clients of dynamic_reconfigure can change as fields of a dataclass."""

from __future__ import annotations

from dataclasses import field, fields
from typing import Any

from pipros_libraries.reconfiguring.server import Setting


def tunable(
    default: Any,
    text: str,
    low: float | None = None,
    high: float | None = None,
    *,
    edit_method: str = "",
    offered: Any = None,
) -> Any:
    """Declare a field of a dataclass as a parameter that clients of dynamic_reconfigure can change.

    See `Setting`. `offered` is the default that clients receive, if it differs from `default`.
    """
    declared = default if offered is None else offered, low, high, text, 0, edit_method
    return field(default=default, metadata={"setting": declared})


def settings_of(kind: type) -> list[Setting]:
    """Return the declared settings of a dataclass."""
    return [Setting(each.name, *each.metadata["setting"]) for each in fields(kind) if each.metadata]


def enum(**constants: int) -> str:
    """Return the edit method of a setting whose value must be one of the constants."""
    listed = [{"name": name, "value": value, "type": "int"} for name, value in constants.items()]
    return repr({"enum": listed, "enum_description": ""})
