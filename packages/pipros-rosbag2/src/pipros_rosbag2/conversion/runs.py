"""Runs of bytes, each converted by one `struct` call that reads and one that writes.

CDR aligns each number to its size, counted from the start of the body, and ROS 1 aligns nothing. A run of
numbers therefore has up to eight layouts, one for each offset in CDR modulo 8 at which it may start.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from pipros.msg.time import NS_PER_S
from pipros_rosbag2.conversion.errors import ConversionError

PHASES = 8


class RunRole(Enum):
    """Role of an item's bytes in a conversion."""

    COPY = "copy"
    DROP = "drop"
    FILL = "fill"


class Check(Enum):
    """Kinds of values that may be invalid in the target format. `patched` corrects them."""

    TIME_TO_ROS2 = "time_to_ros2"
    TIME_TO_ROS1 = "time_to_ros1"
    DURATION_TO_ROS2 = "duration_to_ros2"
    DURATION_TO_ROS1 = "duration_to_ros1"
    LEVEL_TO_ROS2 = "level_to_ros2"
    LEVEL_TO_ROS1 = "level_to_ros1"


@dataclass(frozen=True, slots=True)
class RunItem:
    """Consecutive bytes with one alignment in CDR: a number, a time or a fixed array of numbers.

    Dropped bytes exist only in the source. Filled bytes exist only in the target, and are zero.
    """

    role: RunRole
    size: int
    alignment: int
    check: Check | None = None


@dataclass(frozen=True, slots=True)
class Layout:
    """The layout of a run that starts at a given offset in CDR modulo 8.

    Attributes:
        unpack: reads the copied blocks from the source at an offset.
        pack: writes the blocks.
        source_size, target_size: size in bytes in the source and in the target, including padding in CDR.
        is_plain: whether the run is a single block in both formats.
        checked: offset of each checked item in the source.
    """

    unpack: Callable[..., tuple[Any, ...]]
    pack: Callable[..., bytes]
    source_size: int
    target_size: int
    is_plain: bool
    checked: tuple[tuple[Check, int], ...]


def layout(items: Sequence[RunItem], phase: int, *, to_cdr: bool) -> Layout:
    """Return the layout of a run whose offset in CDR, modulo 8, is `phase`."""
    source, target = _RunFormat(), _RunFormat()
    cdr = target if to_cdr else source
    cdr.size = phase
    checked: list[tuple[Check, int]] = []
    for item in items:
        is_in_cdr = item.role is RunRole.COPY or (item.role is RunRole.FILL) == to_cdr
        if is_in_cdr and item.size:
            cdr.skip(-cdr.size % item.alignment)
        if item.check is not None:
            checked.append((item.check, source.size - (0 if to_cdr else phase)))
        if item.role is RunRole.COPY:
            is_new = source.is_broken or target.is_broken or not source.parts
            source.block(item.size, is_new=is_new)
            target.block(item.size, is_new=is_new)
        elif item.role is RunRole.DROP:
            source.skip(item.size)
        else:
            target.skip(item.size)
    cdr.size -= phase
    read, write = struct.Struct(source.text()), struct.Struct(target.text())
    is_plain = len(source.parts) == len(target.parts) == 1 and source.parts[0][1] == target.parts[0][1] == "s"
    return Layout(read.unpack_from, write.pack, source.size, target.size, is_plain, tuple(checked))


class _RunFormat:
    """A partially built format string for the `struct` module."""

    def __init__(self) -> None:
        self.parts: list[tuple[int, str]] = []
        self.size = 0
        self.is_broken = False

    def skip(self, count: int) -> None:
        if count:
            self.parts.append((count, "x"))
            self.size += count
            self.is_broken = True

    def block(self, count: int, *, is_new: bool) -> None:
        if is_new or self.parts[-1][1] != "s":
            self.parts.append((count, "s"))
        else:
            self.parts[-1] = (self.parts[-1][0] + count, "s")
        self.size += count
        self.is_broken = False

    def text(self) -> str:
        return "<" + "".join(f"{count}{code}" for count, code in self.parts)


_SECONDS_LIMIT = (1 << 31) - 1
_LEVELS = {1: 10, 2: 20, 4: 30, 8: 40, 16: 50}
_TWO_SIGNED = struct.Struct("<ii")
_TWO_UNSIGNED = struct.Struct("<II")
_MIXED = struct.Struct("<iI")


def patched(data: memoryview, offset: int, check: Check) -> memoryview:
    """Return the source with a corrected value at `offset`. The first correction copies the source."""
    if data.readonly:
        data = memoryview(bytearray(data))
    if check is Check.TIME_TO_ROS2:
        _, nanoseconds = _TWO_UNSIGNED.unpack_from(data, offset)
        _TWO_UNSIGNED.pack_into(data, offset, _SECONDS_LIMIT, nanoseconds)
    elif check is Check.TIME_TO_ROS1:
        _TWO_UNSIGNED.pack_into(data, offset, 0, 0)
    elif check is Check.DURATION_TO_ROS2:
        seconds, nanoseconds = _TWO_SIGNED.unpack_from(data, offset)
        carried, nanoseconds = divmod(nanoseconds, NS_PER_S)
        _MIXED.pack_into(data, offset, max(-_SECONDS_LIMIT - 1, seconds + carried), nanoseconds)
    elif check is Check.DURATION_TO_ROS1:
        seconds, nanoseconds = _MIXED.unpack_from(data, offset)
        carried, nanoseconds = divmod(nanoseconds, NS_PER_S)
        _MIXED.pack_into(data, offset, min(_SECONDS_LIMIT, seconds + carried), nanoseconds)
    else:
        data[offset] = _level(data[offset], check)
    return data


def _level(level: int, check: Check) -> int:
    """Convert the level of a log entry. Levels between two named levels are rounded down."""
    if check is Check.LEVEL_TO_ROS2:
        return max((made for known, made in _LEVELS.items() if known <= level), default=0)
    return max((known for known, made in _LEVELS.items() if made <= level), default=1)


TESTS = {
    Check.TIME_TO_ROS2: (3, "> 127"),
    Check.TIME_TO_ROS1: (3, "> 127"),
    Check.DURATION_TO_ROS2: (7, "> 127"),
    Check.DURATION_TO_ROS1: (7, "> 127"),
    Check.LEVEL_TO_ROS2: (0, "> 0"),
    Check.LEVEL_TO_ROS1: (0, "> 0"),
}
"""For each check: the offset of a byte in the item, and the condition under which the item is corrected."""


def check_count(count: int, smallest: int, left: int, max_empty: int) -> None:
    """Check that the remaining bytes can contain an array with `count` elements.

    Args:
        smallest: minimum size of an element in bytes.
        left: number of remaining bytes.
        max_empty: maximum number of elements if `smallest` is 0.

    Raises:
        ConversionError: there are too many elements.
    """
    if smallest * count > left:
        raise ConversionError(f"an array of {count} elements is longer than the data")
    if not smallest and count > max_empty:
        raise ConversionError(f"an array has {count} elements of size 0, but only {max_empty} are allowed")
