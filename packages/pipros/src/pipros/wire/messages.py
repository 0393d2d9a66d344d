"""TCPROS messages: a little-endian 32-bit length, then that many bytes.

`MessageReader` is for topics and service requests. Sockets receive directly into reused memory, because
allocating a buffer of megabytes causes page faults, which dominate the time for large messages. A receiver
that keeps messages would have to copy them, so it can receive large messages as separate `bytes` objects
instead. `ReplyReader` is for service replies, which are messages preceded by a byte that says whether the
call succeeded.

Source: http://wiki.ros.org/ROS/TCPROS
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any

from pipros.basics.errors import LimitExceeded
from pipros.basics.limits import limit_text, process_limits
from pipros.wire.slot_frames import FRAME_BYTES
from pipros.wire.slot_frames import LENGTH as CONTROL_LENGTH

_INITIAL_BYTES = 4 * 1024
_COMFORTABLE_BYTES = 128 * 1024
"""Size above which a buffer or a message counts as large. A buffer starts with `_INITIAL_BYTES`, because a
node may have hundreds of quiet topics.
"""

_ROUNDS = 100
"""A large buffer that has been emptied this many times is replaced by a smaller
one if less than a quarter of it was used."""

_REPLY_HEAD_BYTES = 5
"""Size of a reply's header: one byte for success, and four bytes for the length of the rest."""

_unpack_length = struct.Struct("<I").unpack_from


class MessageReader:
    """A receive buffer that hands out complete messages as views of itself.

    Call `space()`, receive into it, and pass `received()` the number of bytes; or pass bytes that were
    received elsewhere to `feed()`. The messages that these methods yield are valid until the next `space()`
    or `feed()`; copy a message to keep it. The buffer grows to at most twice the size of the data that has
    actually arrived, so announcing a large length does not use memory.

    >>> buffer = MessageReader(limit_bytes=1024)
    >>> [bytes(message) for message in buffer.feed(b"\\x02\\x00\\x00\\x00h")]
    []
    >>> [bytes(message) for message in buffer.feed(b"i")]
    [b'hi']

    Attributes:
        on_control: called with the memory and the offset of each control frame (`pipros.wire.slot_frames`).
            Its result is yielded like a message, unless the result is None. If `on_control` is None, control
            frames are errors.
    """

    __slots__ = (
        "_end",
        "_expects_large",
        "_keeps_large",
        "_largest",
        "_rounds",
        "_start",
        "_store",
        "_view",
        "_whole",
        "is_large",
        "limit_bytes",
        "on_control",
    )

    def __init__(self, limit_bytes: int | None = None, *, keeps_large: bool = False) -> None:
        """Create an empty reader.

        Args:
            limit_bytes: maximum size of a message; defaults to the process-wide `Limits.frame_bytes`.
            keeps_large: whether to receive large messages as separate `bytes` objects; see
                `whole_bytes`.
        """
        self.on_control: Callable[[memoryview, int], Any] | None = None
        self._keeps_large = keeps_large
        self._expects_large = False  # whether to expect another large message, and to receive it as `bytes`
        self._whole: bytes | None = None  # a large message that is received as `bytes`
        self.limit_bytes = process_limits().frame_bytes if limit_bytes is None else limit_bytes
        self._use(bytearray(_INITIAL_BYTES))
        self._start = 0  # index of the first byte that is not in a yielded message
        self._end = 0  # index after the last byte received
        self._rounds = 0  # number of times the buffer was filled and emptied while it was large
        self._largest = 0  # maximum number of bytes held since the last reset

    def space(self) -> memoryview:
        """Return non-empty memory to receive into. Previously yielded messages become invalid."""
        if self._end == len(self._store) < _COMFORTABLE_BYTES:
            self._grow()  # the peer sent more than fits into the buffer
        pending = self._end - self._start
        if not pending:
            if self.is_large:
                self._expects_large = self._keeps_large and self._end > _COMFORTABLE_BYTES
                self._reconsider()
            self._start = self._end = 0
            return self._view[:4] if self._expects_large else self._view
        if self._start and (len(self._store) - self._end < self._missing() or self._end == len(self._store)):
            self._view[:pending] = self._view[self._start : self._end]
            self._start, self._end = 0, pending
        if self._end == len(self._store):
            self._grow()
        if self._keeps_large and pending + (missing := self._missing()) > _COMFORTABLE_BYTES:
            # Read no further than this message, so that the next one can be received whole.
            return self._view[self._end : self._end + missing]
        return self._view[self._end :]

    @property
    def has_partial_message(self) -> bool:
        """Whether part of a message has arrived."""
        return self._end > self._start

    @property
    def capacity_bytes(self) -> int:
        """Size of the buffer, which is at most twice the size of the largest data that it has held."""
        return len(self._store)

    @property
    def partial_bytes(self) -> int:
        """Number of bytes that have arrived of messages that were not yielded yet."""
        return self._end - self._start

    @property
    def whole_bytes(self) -> int:
        """Size of the next message if the caller should receive it and pass it to `feed_whole`; otherwise 0.

        The result is 0 unless only the length of a large message has arrived, and the buffer, which has grown
        for earlier messages, has room for the message.
        """
        if self._expects_large and self._end - self._start == 4:
            (length,) = _unpack_length(self._view, self._start)
            if _COMFORTABLE_BYTES < length <= min(len(self._store) - 4, self.limit_bytes):
                return int(length)
        return 0

    def feed_whole(self, data: bytes) -> int:
        """Add bytes that were received elsewhere. Return their number, which must be passed to `received`.

        If their number is `whole_bytes`, `received` yields them without copying; otherwise they are copied.
        """
        if len(data) == self.whole_bytes:
            self._whole = data
        else:
            self.space()[: len(data)] = data
        return len(data)

    def received(self, count: int) -> Iterator[Any]:
        """Yield the messages completed by `count` more bytes.

        Raises:
            LimitExceeded: an announced message exceeds the limit.
        """
        self._end += count
        if self._whole is not None:
            whole, self._whole = self._whole, None
            self._start = self._end
            yield whole
            return
        view, end = self._view, self._end
        while end - self._start >= 4:
            (length,) = _unpack_length(view, self._start)
            body = self._start + 4
            if length > self.limit_bytes:
                if length == CONTROL_LENGTH and self.on_control is not None:
                    if end - self._start < FRAME_BYTES:
                        return
                    offset, self._start = self._start, self._start + FRAME_BYTES
                    if (message := self.on_control(view, offset)) is not None:
                        yield message
                    continue
                limit = limit_text("frame_bytes", self.limit_bytes)
                raise LimitExceeded(f"a message of {length} bytes was announced; {limit}")
            if end - body < length:
                return
            self._start = body + length
            yield view[body : body + length]

    def feed(self, data: bytes) -> Iterator[Any]:
        """Yield the messages completed by `data`, which is copied before the iteration begins.

        Raises the same errors as `received`.
        """
        if len(self.space()) < len(data):
            self._enlarge(self._end + len(data))
        self._view[self._end : self._end + len(data)] = data
        self._end += len(data)
        return self.received(0)

    def trim(self) -> None:
        """Free the memory of large messages, unless the buffer holds part of a message."""
        if self.is_large and not self.has_partial_message:
            self._start = self._end = 0
            self._use(bytearray(_COMFORTABLE_BYTES))

    def _use(self, store: bytearray) -> None:
        self._store = store
        self._view = memoryview(store)
        self.is_large = len(store) > _COMFORTABLE_BYTES

    def _reconsider(self) -> None:
        """Count one use of a large buffer that is now empty.

        After `_ROUNDS` uses, shrink the buffer if less than a quarter of it was used.
        """
        self._largest = max(self._largest, self._end)
        self._rounds += 1
        if self._rounds >= _ROUNDS:
            if self._largest * 4 < len(self._store):
                self._use(bytearray(max(2 * self._largest, _COMFORTABLE_BYTES)))
            self._rounds = self._largest = 0

    def _missing(self) -> int:
        """Return the number of bytes that are missing from the incomplete message, as far as known."""
        have = self._end - self._start
        if have < 4:
            return 4 - have
        (length,) = _unpack_length(self._view, self._start)
        if length == CONTROL_LENGTH:
            return FRAME_BYTES - have
        return int(length) + 4 - have

    def _grow(self) -> None:
        self._enlarge(min(2 * len(self._store), self.limit_bytes + 4 + _INITIAL_BYTES))

    def _enlarge(self, size: int) -> None:
        larger = bytearray(size)
        larger[: self._end] = self._store
        self._use(larger)


class ReplyReader:
    """Splits the byte stream from a service server into replies.

    Feed it the bytes from the socket, and take the complete replies in order, one at a time. Memory grows
    with the bytes that have actually arrived, never with the length that the server announces.

    >>> replies = ReplyReader(limit_bytes=1024)
    >>> replies.feed(b"\\x01\\x02\\x00\\x00\\x00h")
    >>> replies.next_reply()
    >>> replies.feed(b"i")
    >>> replies.next_reply()
    (True, b'hi')

    Attributes:
        missing_bytes: the number of bytes that the next reply lacks, as far as known after the last call to
            `next_reply`.
    """

    __slots__ = ("_held", "limit_bytes", "missing_bytes")

    def __init__(self, limit_bytes: int | None = None) -> None:
        """Limit each reply to `limit_bytes` (default: the process-wide `Limits.frame_bytes`)."""
        self.limit_bytes = process_limits().frame_bytes if limit_bytes is None else limit_bytes
        self.missing_bytes = _REPLY_HEAD_BYTES
        self._held: bytes | bytearray = b""

    def feed(self, data: bytes) -> None:
        if not self._held:
            self._held = data  # most replies arrive in one piece, and need not be copied
            return
        if not isinstance(self._held, bytearray):
            self._held = bytearray(self._held)
        self._held += data

    def next_reply(self) -> tuple[bool, bytes] | None:
        """Remove and return the next reply: whether the call succeeded, and the response or the error text.

        Returns:
            None if no reply is complete; `missing_bytes` then says how many bytes the next reply lacks.

        Raises:
            LimitExceeded: the announced reply exceeds the limit.
        """
        held = self._held
        missing = _REPLY_HEAD_BYTES - len(held)
        if missing <= 0:
            (length,) = _unpack_length(held, 1)
            if length > self.limit_bytes:
                limit = limit_text("frame_bytes", self.limit_bytes)
                raise LimitExceeded(f"a reply of {length} bytes was announced; {limit}")
            missing += length
            if missing <= 0:
                end = _REPLY_HEAD_BYTES + length
                self._held = bytes(held[end:])
                return held[0] == 1, bytes(held[_REPLY_HEAD_BYTES:end])
        self.missing_bytes = missing
        return None
