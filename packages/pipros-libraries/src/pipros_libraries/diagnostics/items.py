"""Statuses as the aggregator stores and publishes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

OK, WARN, ERROR, STALE = range(4)

LEVEL_NAMES = ("OK", "Warning", "Error", "Stale")


def level_name(level: int) -> str:
    """Return the name of a level: `OK`, `Warning`, `Error`, `Stale`, or `Level` and the number."""
    return LEVEL_NAMES[level] if 0 <= level < len(LEVEL_NAMES) else f"Level {level}"


@dataclass(frozen=True, slots=True)
class ComponentStatus:
    """Contents of a diagnostic_msgs/DiagnosticStatus."""

    name: str
    level: int = STALE
    message: str = "Missing"
    hardware_id: str = ""
    values: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True, slots=True)
class Item:
    """A status and its time of arrival in seconds.

    The time is None if the status is expected but has not arrived.
    """

    status: ComponentStatus
    updated_s: float | None = None

    def below(self, path: str, prefixes: Sequence[str], is_stale: bool) -> ComponentStatus:
        """Return the status to publish below an analyzer's path, without the first matching prefix."""
        name = f"{path}/{output_name(self.status.name, prefixes)}"
        return replace(self.status, name=name, level=STALE if is_stale else self.status.level)


def output_name(name: str, prefixes: Sequence[str]) -> str:
    """Return a status's name as a path component: without its first matching prefix, and without slashes.

    >>> output_name("hokuyo_node: Frequency", ["hokuyo_node"]), output_name("/arm/left", [])
    ('Frequency', ' arm left')
    """
    for prefix in prefixes:
        if prefix and name.startswith(prefix):
            name = name[len(prefix) :].removeprefix(":").lstrip(" ")
            break
    return name.replace("/", " ")
