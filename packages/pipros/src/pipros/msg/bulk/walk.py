"""Find the positions of array elements whose sizes vary.

The position of an element depends on the previous element in the same message, but not on other messages.
Therefore, the first elements of all messages are skipped together, then the second elements, and so on. Once
few messages have elements left, their elements are skipped one by one.
"""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING

import numpy as np

from pipros.msg.bulk.columns import Offsets
from pipros.msg.bulk.cursors import Cursors, TooShort, equal_stride
from pipros.msg.bulk.plans import LENGTH, STRING, FixedRun, MessagePlan, SizedPart, value_dtype
from pipros.msg.language.spec import NUMBERS, TIMES

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FEW = 16
"""Minimum number of messages for which skipping elements together is faster than one by one."""

_U32 = Struct("<I").unpack_from


def element_starts(
    plan: MessagePlan, cursors: Cursors, counts: NDArray[np.int64], offsets: Offsets
) -> NDArray[np.int64]:
    """Return the positions of all elements of arrays whose first elements are at the cursors.

    The caller must have checked that the messages have room for elements of the minimum size.

    Raises:
        TooShort: a message ends before its last element.
    """
    if plan.size is not None:
        within = np.arange(offsets[-1]) - np.repeat(offsets[:-1], counts)
        return np.repeat(cursors.at, counts) + within * plan.size
    starts = np.empty(offsets[-1], np.int64)
    _skip_elements(plan, cursors, counts, (starts, offsets))
    return starts


def _skip_elements(
    plan: MessagePlan,
    cursors: Cursors,
    counts: NDArray[np.int64],
    noted: tuple[NDArray[np.int64], Offsets] | None = None,
) -> NDArray[np.int64]:
    """Return the positions after the elements of arrays.

    If `noted` is given, store each element's position in its first array, at the offsets in its second array.
    """
    order = np.argsort(-counts, kind="stable")
    falling = -counts[order]
    at, ends = cursors.at[order], cursors.ends[order]
    number = 0
    while (active := int(np.searchsorted(falling, -number, "left"))) >= _FEW:
        some = Cursors(cursors.data, at[:active], ends[:active], equal_stride(at[:active]))
        if noted is not None:
            noted[0][noted[1][order[:active]] + number] = some.at
        at[:active] = _skip(plan, some)
        number += 1
    data = cursors.data.data
    for row in range(active):
        position, end = int(at[row]), int(ends[row])
        count = -int(falling[row])
        skip = _skip_string if plan.steps[0] == STRING else _skip_one
        positions = []
        for _ in range(number, count):
            positions.append(position)
            position = skip(plan, data, position, end)
        if noted is not None:
            first = int(noted[1][order[row]])
            noted[0][first + number : first + count] = positions
        at[row] = position
    after = np.empty_like(at)
    after[order] = at
    return after


def _skip(plan: MessagePlan, cursors: Cursors) -> NDArray[np.int64]:
    """Return the positions after the messages at the cursors."""
    for step in plan.steps:
        if isinstance(step, FixedRun):
            cursors.need(step.dtype.itemsize)
            cursors = cursors.moved(step.dtype.itemsize)
            continue
        if step.length is None:
            counts = cursors.read(LENGTH).astype(np.int64)
            cursors = cursors.moved(LENGTH.itemsize)
        else:
            counts = np.full(len(cursors), step.length, np.int64)
        size = element_size(step)
        if size is None and step.element is not None:
            cursors.need(counts * step.element.least_bytes)
            at = _skip_elements(step.element, cursors, counts)
            cursors = Cursors(cursors.data, at, cursors.ends, equal_stride(at))
        else:
            cursors.need(counts * (size or 0))
            cursors = cursors.moved(counts * (size or 0))
    return cursors.at


def _skip_string(_: MessagePlan, data: memoryview, position: int, end: int) -> int:
    """Return the position after a string. Like `_skip_one`, but faster."""
    if position + 4 > end:
        raise TooShort(position, 4, end)
    after: int = position + 4 + _U32(data, position)[0]
    if after > end:
        raise TooShort(position + 4, after - position - 4, end)
    return after


def _skip_one(plan: MessagePlan, data: memoryview, position: int, end: int) -> int:
    """Return the position after one message."""
    for step in plan.steps:
        if isinstance(step, FixedRun):
            position = _checked(position, step.dtype.itemsize, end)
            continue
        count = step.length
        if count is None:
            after = _checked(position, LENGTH.itemsize, end)
            count = _U32(data, position)[0]
            position = after
        size = element_size(step)
        if size is None and step.element is not None:
            _checked(position, count * step.element.least_bytes, end)
            for _ in range(count):
                position = _skip_one(step.element, data, position, end)
        else:
            position = _checked(position, count * (size or 0), end)
    return position


def _checked(position: int, size: int, end: int) -> int:
    if position + size > end:
        raise TooShort(position, size, end)
    return position + size


def element_size(part: SizedPart) -> int | None:
    """Return the size in bytes of an array's elements, or 1 for a string. Return None if the size varies."""
    if not part.is_array:
        return 1
    if part.element is not None:
        return part.element.size
    return value_dtype(part.base).itemsize if part.base in NUMBERS or part.base in TIMES else 0
