"""TCPROS frames: a little-endian 32-bit length, then that many bytes.

Two readers of the same format: `FrameSplitter` for bytes that somebody else received, and
`FrameBuffer` for the hot path, which receives straight into memory that it uses again and again
(fresh megabyte buffers cost page faults, which is what makes large messages slow elsewhere).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from pipros.errors import LimitExceeded

#: A frame's length field can claim 4 GiB; nothing sensible is above one.
FRAME_LIMIT_BYTES = 1 << 30

#: Buffers start small, for nodes with hundreds of quiet topics, and grow to this under traffic.
_INITIAL_BYTES = 4 * 1024
_COMFORTABLE_BYTES = 128 * 1024

_unpack_length = struct.Struct("<I").unpack_from


class FrameSplitter:
    """Cuts an incoming byte stream into TCPROS frames.

    Feed it whatever the socket gave; it returns the frames that became complete, in order.
    Memory grows with the bytes that really arrived, never with the length a peer claims.

    >>> cut = FrameSplitter(limit_bytes=1024)
    >>> cut.feed(b"\\x02\\x00\\x00\\x00h")
    []
    >>> cut.feed(b"i")
    [b'hi']
    """

    def __init__(self, limit_bytes: int = FRAME_LIMIT_BYTES) -> None:
        self._buffer = FrameBuffer(limit_bytes)

    def feed(self, data: bytes) -> list[bytes]:
        """The frames completed by `data`.

        Raises:
            LimitExceeded: a frame above the limit was announced.
        """
        frames: list[bytes] = []
        view = memoryview(data)
        while view:
            room = self._buffer.room()
            count = min(len(room), len(view))
            room[:count] = view[:count]
            view = view[count:]
            frames += [bytes(frame) for frame in self._buffer.received(count)]
        return frames


class FrameBuffer:
    """A receive buffer that hands out complete frames as views of itself.

    Call `room()`, receive into it, tell `received()` how much came. The frames that it yields
    are valid until the next `room()`: who keeps one makes a copy.
    The buffer at most doubles what has really arrived, so a claimed length costs nothing.
    """

    __slots__ = ("_end", "_start", "_store", "_view", "limit_bytes")

    def __init__(self, limit_bytes: int = FRAME_LIMIT_BYTES) -> None:
        self.limit_bytes = limit_bytes
        self._store = bytearray(_INITIAL_BYTES)
        self._view = memoryview(self._store)
        self._start = 0  # of the first byte not handed out yet
        self._end = 0  # of the last byte received

    def room(self) -> memoryview:
        """Memory to receive into, never empty. Frames handed out before become invalid."""
        if self._end == len(self._store) < _COMFORTABLE_BYTES:
            self._grow()  # the peer had more to say than there was room for
        pending = self._end - self._start
        if not pending:
            self._start = self._end = 0
            return self._view
        if self._start and (len(self._store) - self._end < self._missing() or self._end == len(self._store)):
            self._view[:pending] = self._view[self._start : self._end]
            self._start, self._end = 0, pending
        if self._end == len(self._store):
            self._grow()
        return self._view[self._end :]

    @property
    def is_within(self) -> bool:
        """Whether a part of a frame has arrived, and its rest has not."""
        return self._end > self._start

    def received(self, count: int) -> Iterator[memoryview]:
        """Yields the frames completed by `count` more bytes.

        Raises:
            LimitExceeded: a frame above the limit was announced.
        """
        self._end += count
        view, end = self._view, self._end
        while end - self._start >= 4:
            (length,) = _unpack_length(view, self._start)
            body = self._start + 4
            if length > self.limit_bytes:
                raise LimitExceeded(f"frame of {length} bytes announced, the limit is {self.limit_bytes}")
            if end - body < length:
                return
            self._start = body + length
            yield view[body : body + length]

    def _missing(self) -> int:
        """How many bytes the frame under way still lacks, as far as is known."""
        have = self._end - self._start
        if have < 4:
            return 4 - have
        (length,) = _unpack_length(self._view, self._start)
        return int(length) + 4 - have

    def _grow(self) -> None:
        larger = bytearray(min(2 * len(self._store), self.limit_bytes + 4 + _INITIAL_BYTES))
        larger[: self._end] = self._store
        self._store = larger
        self._view = memoryview(larger)
