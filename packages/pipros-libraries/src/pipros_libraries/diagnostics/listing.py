"""Format statuses as terminal output for `rosdiagnostic`."""

from __future__ import annotations

from collections.abc import Iterable

from pipros.basics.printable import printable
from pipros_libraries.diagnostics.items import OK, ComponentStatus, level_name

_LONGEST = 2_000


def listed(
    statuses: Iterable[ComponentStatus], *, least: int = OK, part: str = "", details: bool = False
) -> list[str]:
    """Return a line for each status, sorted by name.

    Args:
        statuses: the statuses in one DiagnosticArray.
        least: the minimum level to include.
        part: the substring that names must contain.
        details: whether to add a line with the hardware ID, and a line for each value.

    >>> listed([ComponentStatus("/b", 0, "fine"), ComponentStatus("/a", 2, "broken")], least=1)
    ['Error    /a: broken']
    """
    lines = []
    for status in sorted(statuses, key=lambda status: status.name):
        if status.level < least or part not in status.name:
            continue
        name, message = printable(status.name, _LONGEST), printable(status.message, _LONGEST)
        lines.append(f"{level_name(status.level):<8} {name}: {message}".rstrip(": "))
        if details:
            values = [("hardware_id", status.hardware_id)] if status.hardware_id else []
            for key, value in [*values, *status.values]:
                lines.append(f"           {printable(key, _LONGEST)}: {printable(value, _LONGEST)}")
    return lines
