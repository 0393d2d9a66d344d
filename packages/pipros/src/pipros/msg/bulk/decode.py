"""Decode joined messages of one type into columns, all messages at once.

A run of values is read at the cursors of all messages: as strided views if the cursors are equally far apart,
otherwise with one copy. A part of variable size moves each cursor by the size of the part in that message.
The elements of arrays of messages have separate cursors, which `walk.py` finds.

Memory use is proportional to the size of the data: before memory is allocated for an array, its claimed
length is compared with the number of bytes left.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.msg.bulk.columns import (
    Column,
    ListColumn,
    OctetColumn,
    Offsets,
    RecordColumn,
    TextColumn,
    offsets_of,
)
from pipros.msg.bulk.cursors import Cursors, TooShort, equal_stride, values_at
from pipros.msg.bulk.plans import LENGTH, FixedField, FixedRun, MessagePlan, SizedPart, value_dtype
from pipros.msg.bulk.walk import element_starts
from pipros.msg.language.spec import NUMBERS, OCTETS, TIMES
from pipros.msg.time import NS_PER_S

if TYPE_CHECKING:
    from numpy.typing import NDArray


class MalformedMessage(Exception):
    """A message does not match its definition. `row` is its index; the text gives the reason."""

    def __init__(self, row: int, reason: str) -> None:
        super().__init__(reason)
        self.row = row


def decode(
    plan: MessagePlan, data: bytes | bytearray | NDArray[np.uint8], ends: Offsets, *, datetimes: bool = False
) -> dict[str, Column]:
    """Return the columns of joined messages, by field name.

    Args:
        plan: the plan for the type of the messages.
        data: the messages, joined. Columns may be views of the data.
        ends: the position at which each message ends.
        datetimes: whether to return times as `datetime64[ns]` and durations as `timedelta64[ns]`, instead of
            integers.

    Raises:
        MalformedMessage: a message is shorter than its definition requires.
    """
    array: NDArray[np.uint8] = np.frombuffer(data, np.uint8)
    array.flags.writeable = False
    starts = np.concatenate((np.zeros(1, np.int64), ends[:-1])) if len(ends) else ends
    cursors = Cursors(array, starts, ends, equal_stride(starts))
    if (short := ends - starts < plan.least_bytes).any():
        row = int(short.argmax())
        raise _malformed(
            plan, row, int(starts[row]), TooShort(int(starts[row]), plan.least_bytes, int(ends[row]))
        )
    try:
        columns, _ = _BulkDecoder(datetimes).columns(plan, cursors)
    except TooShort as error:
        row = int(np.searchsorted(ends, error.end))  # no message is empty here, so each end is unique
        raise _malformed(plan, row, int(starts[row]), error) from None
    return columns


def _malformed(plan: MessagePlan, row: int, start: int, error: TooShort) -> MalformedMessage:
    return MalformedMessage(
        row,
        f"its {error.end - start} bytes do not match the definition of {plan.type}: {error.needed} bytes "
        f"must follow at byte {error.position - start}, got {error.end - error.position}",
    )


class _BulkDecoder:
    def __init__(self, datetimes: bool) -> None:
        self._datetimes = datetimes

    def columns(self, plan: MessagePlan, cursors: Cursors) -> tuple[dict[str, Column], Cursors]:
        """Return the columns of the messages at the cursors, and cursors at the ends of the messages."""
        found: dict[str, Column] = {}
        for step in plan.steps:
            if isinstance(step, FixedRun):
                run = cursors.read(step.dtype)
                for field in step.fields:
                    found[field.name] = self._fixed(run[field.name], field)
                cursors = cursors.moved(step.dtype.itemsize)
            else:
                found[step.name], cursors = self._part(step, cursors)
        return found, cursors

    def _fixed(self, values: NDArray[Any], field: FixedField) -> NDArray[Any]:
        if field.base == "bool":
            return np.not_equal(values, 0)
        return self._times(values, field.base) if field.base in TIMES else values

    def _times(self, pairs: NDArray[Any], base: str) -> NDArray[Any]:
        """Convert pairs of seconds and nanoseconds to nanoseconds or datetimes."""
        nanoseconds = pairs[..., 0].astype(np.int64)
        nanoseconds *= NS_PER_S
        nanoseconds += pairs[..., 1]
        if not self._datetimes:
            return nanoseconds
        return nanoseconds.view("M8[ns]" if base == "time" else "m8[ns]")

    def _part(self, part: SizedPart, cursors: Cursors) -> tuple[Column, Cursors]:
        if part.length is not None:
            counts = np.full(len(cursors), part.length, np.int64)
        else:
            counts = cursors.read(LENGTH).astype(np.int64)
            cursors = cursors.moved(LENGTH.itemsize)
        if part.element is not None and part.is_array:
            return self._elements(part.element, counts, cursors)
        if not part.is_array or part.base in OCTETS:
            kind = OctetColumn if part.is_array else TextColumn
            return kind(offsets_of(counts), cursors.parts(counts)), cursors.moved(counts)
        if part.base not in TIMES and part.base not in NUMBERS:  # messages that take no bytes
            return counts, cursors
        dtype = value_dtype(part.base)
        sizes = counts * dtype.itemsize
        cursors.need(sizes)
        equal = int(counts[0]) if len(counts) and cursors.stride and (counts == counts[0]).all() else 0
        if equal and dtype.shape == ():
            rows = values_at(cursors.data, cursors.at, cursors.stride, np.dtype((dtype, (equal,))))
            values: NDArray[Any] = np.not_equal(rows, 0) if part.base == "bool" else rows
            return ListColumn(offsets_of(counts), values), cursors.moved(sizes)
        values = cursors.parts(sizes).view(dtype.base)
        if part.base == "bool":
            values = values != 0
        elif part.base in TIMES:
            values = self._times(values.reshape(-1, 2), part.base)
        return ListColumn(offsets_of(counts), values), cursors.moved(sizes)

    def _elements(
        self, plan: MessagePlan, counts: NDArray[np.int64], cursors: Cursors
    ) -> tuple[ListColumn, Cursors]:
        """Return the column of an array of messages or strings, and cursors at the ends of the arrays."""
        cursors.need(counts * plan.least_bytes)
        offsets = offsets_of(counts)
        starts = element_starts(plan, cursors, counts, offsets)
        ends = np.repeat(cursors.ends, counts)
        columns, after = self.columns(plan, Cursors(cursors.data, starts, ends, equal_stride(starts)))
        at = cursors.at.copy()
        filled = counts > 0
        at[filled] = after.at[offsets[1:][filled] - 1]
        values: Column = columns[""] if "" in columns else RecordColumn(columns, len(starts))
        return ListColumn(offsets, values), Cursors(cursors.data, at, cursors.ends, equal_stride(at))
