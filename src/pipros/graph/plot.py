"""Messages as rows of a table: `rostopic echo -p`, for plotting and spreadsheets."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pipros.graph.message_path import Part
from pipros.msg.base import Message
from pipros.msg.time import Time, TVal
from pipros.printable import listed


class Plot:
    """Flattens values to columns, one for each element of an array."""

    def __init__(self, *, no_arrays: bool = False, no_texts: bool = False) -> None:
        self._no_arrays = no_arrays
        self._no_texts = no_texts

    def heading(self, part: Part) -> str:
        """`%time,field.data`: the names of the columns."""
        return "%time," + ",".join(name for name, _ in self._columns("field", part, 0))

    def row(self, part: Part, time_ns: int, offset_ns: int = 0) -> str:
        """The values. Times are in nanoseconds; `offset_ns` is subtracted from points in time."""
        columns = self._columns("field", part, offset_ns)
        return f"{time_ns - offset_ns}," + ",".join(text for _, text in columns)

    def _columns(self, name: str, part: Part, offset_ns: int) -> Iterator[tuple[str, str]]:
        value, kind = part.value, part.type_name or ""
        if isinstance(value, Message):
            for field, field_kind in zip(value.__slots__, value._slot_types, strict=True):
                yield from self._columns(
                    f"{name}.{field}", Part(getattr(value, field), field_kind), offset_ns
                )
        elif isinstance(value, (list, tuple)):
            if not self._no_arrays and not kind.startswith("uint8["):
                for index, element in enumerate(value):
                    element_part = Part(element, kind.partition("[")[0])
                    yield from self._columns(f"{name}{index}", element_part, offset_ns)
        elif isinstance(value, str):
            if not self._no_texts:
                yield name, _cell(value)
        elif not isinstance(value, (bytes, bytearray)):
            yield name, _plain(value, offset_ns)


def _cell(text: str) -> str:
    """A string as one cell, in quotes when it could be read as something else."""
    text = listed(text)
    return '"' + text.replace('"', '""') + '"' if "," in text or text.startswith('"') else text


def _plain(value: Any, offset_ns: int) -> str:
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, TVal):
        return str(value.to_nsec() - (offset_ns if isinstance(value, Time) else 0))
    return str(value)
