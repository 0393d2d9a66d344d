"""Formats messages as table rows, as `rostopic echo -p` does for plotting and spreadsheets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from pipros.basics.printable import listed
from pipros.msg.base import Message
from pipros.msg.time import Time, TVal
from pipros_tools.graph.message_path import Part

FieldFilter = Callable[[Any], list[str]]
"""Function that returns the names of the fields to show in a message."""


def field_filter(*, no_arrays: bool, no_texts: bool) -> FieldFilter:
    """Return a filter that drops arrays, or strings and arrays of strings."""

    def shown(message: Any) -> list[str]:
        kinds = zip(message.__slots__, message._slot_types, strict=True)
        return [
            name
            for name, kind in kinds
            if not (no_arrays and "[" in kind) and not (no_texts and "string" in kind)
        ]

    return shown


class MessageRows:
    """Flattens values into columns, one per array element. Arrays of bytes have no columns."""

    def __init__(self, shown: FieldFilter | None = None) -> None:
        """Store the filter.

        `shown` selects the fields of each message; values that are not messages are always shown.
        """
        self._shown = shown

    def heading(self, part: Part) -> str:
        """Return the column names, such as `%time,field.data`."""
        return "%time," + ",".join(name for name, _ in self._columns("field", part, 0))

    def row(self, part: Part, time_ns: int, offset_ns: int = 0) -> str:
        """Return the values as a row.

        Times are in nanoseconds; `offset_ns` is subtracted from times, but not from durations.
        """
        columns = self._columns("field", part, offset_ns)
        return f"{time_ns - offset_ns}," + ",".join(text for _, text in columns)

    def _columns(self, name: str, part: Part, offset_ns: int) -> Iterator[tuple[str, str]]:
        value, kind = part.value, part.type_name or ""
        if isinstance(value, Message):
            shown = value.__slots__ if self._shown is None else self._shown(value)
            for field, field_kind in zip(value.__slots__, value._slot_types, strict=True):
                if field in shown:
                    part = Part(getattr(value, field), field_kind)
                    yield from self._columns(f"{name}.{field}", part, offset_ns)
        elif isinstance(value, (list, tuple)):
            if not kind.startswith("uint8["):
                for index, element in enumerate(value):
                    element_part = Part(element, kind.partition("[")[0])
                    yield from self._columns(f"{name}{index}", element_part, offset_ns)
        elif isinstance(value, str):
            yield name, _cell(value)
        elif not isinstance(value, (bytes, bytearray)):
            yield name, _plain(value, offset_ns)


def _cell(text: str) -> str:
    """Return a string as one cell, quoted if it could be misread."""
    text = listed(text)
    return '"' + text.replace('"', '""') + '"' if "," in text or text.startswith('"') else text


def _plain(value: Any, offset_ns: int) -> str:
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, TVal):
        return str(value.to_nsec() - (offset_ns if isinstance(value, Time) else 0))
    return str(value)
