"""A queue of messages for one subscriber: the rest of a partially sent message, then whole messages."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Sequence

from pipros.net.sockets import GATHER_LIMIT

Buffer = bytes | memoryview

WireMessage = Sequence[Buffer]
"""A message, preceded by its length, as buffers to be written in order."""

LARGE_BYTES = 64 * 1024
"""If the rest of a buffer has at least this size, a short wait until the socket is writable is worthwhile."""


class Backlog:
    """A queue of messages that are written when the socket accepts them. Not thread-safe.

    A partially written message must be completed, so only unwritten messages are dropped, oldest first.
    """

    __slots__ = ("_rest", "_waiting", "_waiting_bytes")

    def __init__(self) -> None:
        self._rest: deque[Buffer] = deque()  # the rest of a partially written message
        self._waiting: deque[tuple[WireMessage, int]] = deque()  # whole messages and their sizes
        self._waiting_bytes = 0

    def __bool__(self) -> bool:
        """Return True if a message is queued."""
        return bool(self._rest or self._waiting)

    @property
    def is_in_large_buffer(self) -> bool:
        """Whether a message is partially written, with at least LARGE_BYTES left in its next buffer."""
        return bool(self._rest) and len(self._rest[0]) >= LARGE_BYTES

    def append(self, message: WireMessage, size: int) -> None:
        """Add a message of `size` bytes. Buffers that the publisher may change later are copied."""
        self._waiting.append((_copy_mutable(message), size))
        self._waiting_bytes += size

    def append_rest(self, message: WireMessage, sent: int) -> None:
        """Add a message to an empty backlog. Its first `sent` bytes have already been written."""
        self._keep_rest(_copy_mutable(message), sent)

    def insert(self, frame: bytes) -> bool:
        """Add a frame before all whole messages. `drop_oldest` does not drop it.

        Return True if `remove_sent` will count the frame as a message. It does so if no message is partially
        written.
        """
        is_alone = not self._rest
        self._rest.append(frame)
        return is_alone

    def next_buffers(self) -> list[Buffer]:
        """Return the next buffers to write, at most as many as a single gathered write accepts."""
        waiting = itertools.chain.from_iterable(message for message, _ in self._waiting)
        return list(itertools.islice(itertools.chain(self._rest, waiting), GATHER_LIMIT))

    def remove_sent(self, sent: int) -> int:
        """Remove `sent` written bytes from the front; return the number of messages that this completed."""
        messages = 0
        while self._rest and sent >= len(self._rest[0]):
            sent -= len(self._rest.popleft())
            messages += not self._rest
        if self._rest:
            self._rest[0] = memoryview(self._rest[0])[sent:]
            return messages
        while sent:
            message, size = self._waiting.popleft()
            self._waiting_bytes -= size
            if sent < size:
                self._keep_rest(message, sent)
                break
            sent -= size
            messages += 1
        return messages

    def drop_oldest(self, max_messages: int | None, max_bytes: int, spared_bytes: int = 0) -> int:
        """Drop the oldest messages to meet the limits, but never the newest. Return the number dropped.

        `max_messages` does not apply while the backlog has at most `spared_bytes`.
        """
        dropped = 0
        while len(self._waiting) > 1 and (
            (max_messages and len(self._waiting) > max_messages and self._waiting_bytes > spared_bytes)
            or self._waiting_bytes > max_bytes
        ):
            _, size = self._waiting.popleft()
            self._waiting_bytes -= size
            dropped += 1
        return dropped

    def clear(self) -> int:
        """Drop all messages, including a partially written one, and return their number."""
        dropped = len(self._waiting) + bool(self._rest)
        self._rest.clear()
        self._waiting.clear()
        self._waiting_bytes = 0
        return dropped

    def _keep_rest(self, message: WireMessage, sent: int) -> None:
        for buffer in message:
            if sent >= len(buffer):
                sent -= len(buffer)
            else:
                self._rest.append(memoryview(buffer)[sent:])
                sent = 0


def _copy_mutable(message: WireMessage) -> WireMessage:
    """Return the message in immutable buffers, because the publisher may reuse its arrays."""
    return [buffer if _is_constant(buffer) else bytes(buffer) for buffer in message]


def _is_constant(buffer: Buffer) -> bool:
    return not isinstance(buffer, memoryview) or type(buffer.obj) is bytes
