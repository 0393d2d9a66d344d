"""The frames that wait for one subscriber: the rest of one, and whole ones behind it."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Sequence

from pipros.net.sockets import GATHER_LIMIT

Buffer = bytes | memoryview

#: A frame as it goes over the wire, its length in front: buffers to be written in a row.
Frame = Sequence[Buffer]

#: The rest of a buffer of this size is worth a short wait for room.
LARGE_BYTES = 64 * 1024


class Backlog:
    """A queue of frames that are written as the socket takes them. Not thread-safe.

    A frame of which a part went out must follow whole, so only frames of which nothing went out are
    ever dropped: the oldest first.
    """

    __slots__ = ("_rest", "_waiting", "_waiting_bytes")

    def __init__(self) -> None:
        self._rest: deque[Buffer] = deque()  # of a frame that is partly out
        self._waiting: deque[tuple[Frame, int]] = deque()  # whole frames and their sizes
        self._waiting_bytes = 0

    def __bool__(self) -> bool:
        """True while anything waits."""
        return bool(self._rest or self._waiting)

    @property
    def is_in_large_buffer(self) -> bool:
        """True while the next bytes to go are the rest of a buffer of LARGE_BYTES and more."""
        return bool(self._rest) and len(self._rest[0]) >= LARGE_BYTES

    def append(self, frame: Frame, size: int) -> None:
        """Adds a frame of `size` bytes. It is copied where the publisher may change it later."""
        self._waiting.append((_copy_mutable(frame), size))
        self._waiting_bytes += size

    def append_rest(self, frame: Frame, sent: int) -> None:
        """Adds what is left of a frame of which `sent` bytes are out, to a backlog that is empty."""
        self._keep_rest(_copy_mutable(frame), sent)

    def next_buffers(self) -> list[Buffer]:
        """The next buffers to write, no more than one gathered write takes."""
        waiting = itertools.chain.from_iterable(frame for frame, _ in self._waiting)
        return list(itertools.islice(itertools.chain(self._rest, waiting), GATHER_LIMIT))

    def forget(self, sent: int) -> int:
        """Takes `sent` bytes off the front: they are out. Returns how many frames that completed."""
        frames = 0
        while self._rest and sent >= len(self._rest[0]):
            sent -= len(self._rest.popleft())
            frames += not self._rest
        if self._rest:
            self._rest[0] = memoryview(self._rest[0])[sent:]
            return frames
        while sent:
            frame, size = self._waiting.popleft()
            self._waiting_bytes -= size
            if sent < size:
                self._keep_rest(frame, sent)
                break
            sent -= size
            frames += 1
        return frames

    def drop_oldest(self, most_frames: int | None, most_bytes: int) -> int:
        """Drops frames until so many, and so many bytes of them, are left; the newest one always stays.

        Returns how many were dropped.
        """
        dropped = 0
        while len(self._waiting) > 1 and (
            (most_frames and len(self._waiting) > most_frames) or self._waiting_bytes > most_bytes
        ):
            _, size = self._waiting.popleft()
            self._waiting_bytes -= size
            dropped += 1
        return dropped

    def clear(self) -> None:
        self._rest.clear()
        self._waiting.clear()
        self._waiting_bytes = 0

    def _keep_rest(self, frame: Frame, sent: int) -> None:
        for buffer in frame:
            if sent >= len(buffer):
                sent -= len(buffer)
            else:
                self._rest.append(memoryview(buffer)[sent:])
                sent = 0


def _copy_mutable(frame: Frame) -> Frame:
    """The frame in buffers that cannot change any more: the publisher may reuse its message."""
    return [buffer if _is_constant(buffer) else bytes(buffer) for buffer in frame]


def _is_constant(buffer: Buffer) -> bool:
    return not isinstance(buffer, memoryview) or type(buffer.obj) is bytes
