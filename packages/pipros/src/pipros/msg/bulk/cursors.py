"""Read joined messages at many positions at once: one position per message or array element."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BLOCK_BYTES = 1 << 22
"""Approximate number of bytes that `joined_parts` copies in one step by index.

Each copied byte temporarily needs at least 16 bytes for its index.
"""

_LONG_BYTES = 64
"""Mean size of parts above which they are copied one by one, as slices."""
_LONG_EQUAL_BYTES = 2048
"""The same limit, if the parts have at most _FEW_SIZES different sizes."""
_FEW_SIZES = 24
"""Maximum number of different sizes for which the parts of each size are copied together."""


class TooShort(Exception):
    """A message ends too early.

    Attributes:
        position: the position of the failed read.
        needed: the number of bytes that the read requires.
        end: the end of the message.
    """

    def __init__(self, position: int, needed: int, end: int) -> None:
        super().__init__(position, needed, end)
        self.position = position
        self.needed = needed
        self.end = end


class Cursors:
    """Positions in joined messages, each with the end of its message.

    Attributes:
        data: the joined messages.
        at, ends: for each cursor, its position, and the end of its message.
        stride: the distance between consecutive cursors, if it is constant; otherwise None. With a constant
            distance, values are read without a copy.
    """

    __slots__ = ("at", "data", "ends", "stride")

    def __init__(
        self,
        data: NDArray[np.uint8],
        at: NDArray[np.int64],
        ends: NDArray[np.int64],
        stride: int | None = None,
    ) -> None:
        self.data = data
        self.at = at
        self.ends = ends
        self.stride = stride

    def __len__(self) -> int:
        return len(self.at)

    def need(self, sizes: NDArray[np.int64] | int) -> None:
        """Raise `TooShort` if a message has fewer bytes left than `sizes`."""
        left = self.ends - self.at
        if (short := left < sizes).any():
            first = int(short.argmax())
            needed = sizes if isinstance(sizes, int) else int(sizes[first])
            raise TooShort(int(self.at[first]), needed, int(self.ends[first]))

    def read(self, dtype: np.dtype[Any]) -> NDArray[Any]:
        """Return the value at each cursor, decoded as `dtype`."""
        self.need(dtype.itemsize)
        return values_at(self.data, self.at, self.stride, dtype)

    def moved(self, sizes: NDArray[np.int64] | int) -> Cursors:
        """Return the cursors, each moved forward by `sizes` bytes."""
        stride = self.stride
        if stride is not None and not isinstance(sizes, int) and len(sizes) and sizes.min() != sizes.max():
            stride = None
        return Cursors(self.data, self.at + sizes, self.ends, stride)

    def parts(self, sizes: NDArray[np.int64]) -> NDArray[np.uint8]:
        """Return the next `sizes` bytes at each cursor, joined."""
        self.need(sizes)
        return joined_parts(self.data, self.at, sizes, self.stride)


def equal_stride(at: NDArray[np.int64]) -> int | None:
    """Return the distance between consecutive positions, or None if it varies or is not positive."""
    if len(at) < 2:
        return 1 if len(at) else None
    step = int(at[1]) - int(at[0])
    return step if step > 0 and bool((np.diff(at) == step).all()) else None


def values_at(
    data: NDArray[np.uint8], at: NDArray[np.int64], stride: int | None, dtype: np.dtype[Any]
) -> NDArray[Any]:
    """Return the value at each position, decoded as `dtype`. The positions are not checked."""
    count = len(at)
    if not count:
        return np.empty(0, dtype)
    if stride is not None:
        return np.ndarray(count, dtype, data.data, int(at[0]), (stride,))
    kind = np.dtype((np.void, dtype.itemsize))
    windows: NDArray[Any] = np.ndarray(len(data) - dtype.itemsize + 1, kind, data.data, 0, (1,))
    return windows[at].view(dtype)


def joined_parts(
    data: NDArray[np.uint8],
    at: NDArray[np.int64],
    sizes: NDArray[np.int64],
    stride: int | None = None,
    out: NDArray[np.uint8] | None = None,
) -> NDArray[np.uint8]:
    """Return the parts of `data` with these positions and sizes, joined.

    The parts are written to `out`, if given. Its size must be the sum of `sizes`.
    """
    total = int(sizes.sum())
    joined = np.empty(total, np.uint8) if out is None else out
    if not total:
        return joined
    first = int(sizes[0])
    if first < _LONG_EQUAL_BYTES and (sizes == first).all():
        kind = np.dtype((np.void, first))
        joined.view(kind)[:] = values_at(data, at, stride, kind)
        return joined
    if int(sizes.max()) < _LONG_EQUAL_BYTES:
        different = np.flatnonzero(np.bincount(sizes)).tolist()
        if len(different) <= _FEW_SIZES:
            starts = np.cumsum(sizes) - sizes
            for size in filter(None, different):
                equal = np.flatnonzero(sizes == size)
                kind = np.dtype((np.void, size))
                windows: NDArray[Any] = np.ndarray(total - size + 1, kind, joined.data, 0, (1,))
                windows[starts[equal]] = values_at(data, at[equal], None, kind)
            return joined
    if total >= _LONG_BYTES * len(sizes):
        view, target, done = data.data, joined.data, 0
        for begin, size in zip(at.tolist(), sizes.tolist(), strict=True):
            target[done : done + size] = view[begin : begin + size]
            done += size
        return joined
    done, rows = 0, max(1, len(sizes) * _BLOCK_BYTES // total)
    for begin in range(0, len(sizes), rows):
        some = sizes[begin : begin + rows]
        ends = np.cumsum(some)
        count = int(ends[-1])
        index = np.repeat(at[begin : begin + rows] - (ends - some), some) + np.arange(count)
        np.take(data, index, out=joined[done : done + count], mode="clip")
        done += count
    return joined
