"""The subscriber's side of shared memory: segments, slots, and the arrays that refer to them.

See `pipros.wire.slot_frames` for the frames. A message in a slot is delivered in one of two ways:

- As a view that is valid during the call. The slot is returned afterwards.
- As a view of a numpy array (`HeldSlot.lend`). All arrays derived from this array keep it alive, so a weak
  reference to it reports when nothing refers to the slot any more. This can happen in any thread. (A
  `memoryview` alone is not suitable: its slices outlive its `release`, and would then show a later message.)

A publisher that violates the protocol cannot make a reader access memory outside a segment. If it changes a
message that is being read, the reader gets wrong values, just as any publisher can send wrong values.
"""

from __future__ import annotations

import array
import contextlib
import os
import socket
import stat
import sys
import weakref
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import ProtocolError
from pipros.basics.extras import required
from pipros.basics.posix import call_in_children
from pipros.wire.slot_frames import (
    OFFER,
    READY,
    SEGMENT,
    SLOT,
    ControlFrame,
    Slot,
    decode,
    encode_acknowledgement,
)

if TYPE_CHECKING:
    import mmap

_DESCRIPTORS: Final = 2
"""Maximum number of descriptors that arrive with a frame: a segment, and the end of a pipe."""
_SLOTS: Final = 64
"""Maximum number of slots that a publisher may announce."""
_RIGHTS_BYTES: Final = 64
"""Space for descriptors in one call of `recvmsg`."""
_CLOEXEC: Final[int] = getattr(socket, "MSG_CMSG_CLOEXEC", 0)
_TRUNCATED: Final[int] = getattr(socket, "MSG_CTRUNC", 0)


class NoSharedMemory(ProtocolError):
    """Shared memory cannot be used with a publisher. The next link to it should not request shared memory."""


class DescriptorSocket(socket.socket):
    """A Unix stream that can receive file descriptors together with bytes.

    Before `accept_descriptors`, it is as fast as an ordinary socket. Afterwards, the receiving methods raise
    NoSharedMemory if more descriptors arrive than a frame can announce.
    """

    def __init__(self, sock: socket.socket) -> None:
        """Take over the descriptor of a socket."""
        timeout_s = sock.gettimeout()
        super().__init__(sock.family, sock.type, sock.proto, fileno=sock.detach())
        self.settimeout(timeout_s)
        self._descriptors: list[int] = []

    def accept_descriptors(self) -> None:
        """Receive descriptors from now on. May be called repeatedly."""
        # replaced only now, because the methods of `socket` are faster: they run no Python code
        vars(self).update(recv=self._recv, recv_into=self._recv_into)

    def _recv_into(self, buffer: Any, nbytes: int = 0, flags: int = 0, /) -> int:
        del nbytes
        if sys.platform != "linux":
            return super().recv_into(buffer, 0, flags)
        count, rights, seen, _ = self.recvmsg_into([buffer], _RIGHTS_BYTES, flags | _CLOEXEC)
        if rights or seen & _TRUNCATED:
            self._keep(rights, seen)
        return count

    def _recv(self, bufsize: int, flags: int = 0, /) -> bytes:
        if sys.platform != "linux":
            return super().recv(bufsize, flags)
        data, rights, seen, _ = self.recvmsg(bufsize, _RIGHTS_BYTES, flags | _CLOEXEC)
        if rights or seen & _TRUNCATED:
            self._keep(rights, seen)
        return data

    def take_descriptor(self) -> int:
        """Return the next descriptor, which the caller must close.

        Raises:
            NoSharedMemory: none has arrived.
        """
        if not self._descriptors:
            raise NoSharedMemory("a descriptor was announced but not sent")
        return self._descriptors.pop(0)

    def close(self) -> None:
        """Close the socket and the descriptors that `take_descriptor` has not returned."""
        super().close()
        vars(self).pop("recv", None)  # break the reference cycles with this object
        vars(self).pop("recv_into", None)
        while self._descriptors:
            os.close(self._descriptors.pop())

    def _keep(self, rights: list[Any], seen: int) -> None:
        for level, kind, data in rights:
            if sys.platform == "linux" and (level, kind) == (socket.SOL_SOCKET, socket.SCM_RIGHTS):
                self._descriptors += array.array("i", data[: len(data) // 4 * 4])
        if seen & _TRUNCATED or len(self._descriptors) > _DESCRIPTORS:
            raise NoSharedMemory("more descriptors were sent than announced, or than this process may open")


class AcknowledgementPipe:
    """The pipe through which slots are returned. Its methods may be called from any thread, at any time.

    It is closed once nothing refers to it. If the link closed it, a thread that returns a slot at the same
    moment could write to another file that has taken over the descriptor's number.
    """

    def __init__(self, descriptor: int) -> None:
        """Reopen the pipe, so that the publisher cannot make writes to this end block.

        Raises:
            NoSharedMemory: the descriptor is not a pipe.
            OSError: the pipe cannot be opened.
        """
        self._descriptor = -1
        if not stat.S_ISFIFO(os.fstat(descriptor).st_mode):
            raise NoSharedMemory("the descriptor for acknowledgements must be a pipe")
        path = f"/proc/self/fd/{descriptor}"
        self._descriptor = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
        self._lent: dict[Slot, weakref.ref[Any]] = {}
        _close_in_children(self)

    def acknowledge(self, slot: Slot, *, in_use: bool) -> None:
        if self._descriptor >= 0:
            with contextlib.suppress(OSError):  # the publisher has ended, or does not read the pipe
                os.write(self._descriptor, encode_acknowledgement(slot, in_use=in_use))

    def lend(self, slot: Slot, lent: Any) -> None:
        """Return a slot once the array `lent`, and everything derived from it, has been deleted."""
        self.acknowledge(slot, in_use=True)
        self._lent[slot] = weakref.ref(lent, partial(self._take_back, slot))

    def close(self) -> None:
        """Close the pipe. Slots are no longer returned."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)

    def _take_back(self, slot: Slot, reference: object) -> None:
        del reference, self._lent[slot]
        self.acknowledge(slot, in_use=False)

    def __del__(self) -> None:
        self.close()


class HeldSlot:
    """A message in a slot. Call `read` or `lend` at most once, then `release`."""

    __slots__ = ("_memory", "_pipe", "_slot", "_start", "size")

    def __init__(
        self, pipe: AcknowledgementPipe, memory: mmap.mmap, slot: Slot, start: int, size: int
    ) -> None:
        self.size = size
        self._pipe: AcknowledgementPipe | None = pipe
        self._memory = memory
        self._slot = slot
        self._start = start

    def read(self) -> memoryview:
        """Return the message. It is valid until `release`."""
        return memoryview(self._memory)[self._start : self._start + self.size]

    def lend(self) -> memoryview:
        """Return a read-only view of an array over the message. It is valid as long as it is referenced."""
        numpy = required("numpy", "zero_copy=True needs numpy", "numpy")
        lent: Any = numpy.frombuffer(self._memory, numpy.uint8, self.size, self._start)
        pipe, self._pipe = self._pipe, None
        if pipe is not None:
            pipe.lend(self._slot, lent)
        return memoryview(lent)

    def release(self) -> None:
        """Return the slot, unless it was lent."""
        pipe, self._pipe = self._pipe, None
        if pipe is not None:
            pipe.acknowledge(self._slot, in_use=False)


class SlotReceiver:
    """Maps the segments of one publisher, and finds the messages in their slots. Not thread-safe."""

    def __init__(self, sock: DescriptorSocket, limit_bytes: int) -> None:
        """Accept messages of at most `limit_bytes`."""
        self._sock = sock
        self._limit_bytes = limit_bytes
        self._pipe: AcknowledgementPipe | None = None
        self._memory: mmap.mmap | None = None
        self._segment = ControlFrame(SEGMENT, 0)

    def receive(self, data: memoryview, offset: int) -> HeldSlot | None:
        """Apply the control frame at `offset`; return the message that it announces, if any.

        Raises:
            NoSharedMemory: the publisher violates the protocol, or the system refuses the memory.
            ProtocolError: the frame is unknown.
        """
        frame = decode(data, offset)
        if frame.kind == SLOT:
            return self._find(frame)
        if frame.kind == SEGMENT:
            self._map(frame)
        elif frame.kind == OFFER:
            self._sock.accept_descriptors()
            with contextlib.suppress(OSError):  # the link has ended, which the next reading call reports
                self._sock.send(READY)
        elif frame.segment == self._segment.segment:
            self._memory = None
        return None

    def close(self) -> None:
        """Release the memory. It is unmapped when no message refers to it any more."""
        self._memory = self._pipe = None

    def _find(self, frame: ControlFrame) -> HeldSlot:
        segment, memory, pipe = self._segment, self._memory, self._pipe
        if memory is None or pipe is None or frame.segment != segment.segment:
            raise NoSharedMemory("a message refers to shared memory that was not announced")
        if frame.first >= segment.second or frame.second > min(segment.first, self._limit_bytes):
            raise NoSharedMemory("a message extends beyond its slot")
        start = frame.first * segment.first
        return HeldSlot(pipe, memory, (frame.segment, frame.first), start, frame.second)

    def _map(self, frame: ControlFrame) -> None:
        # imported here because only large messages need them
        from pipros.net.shared_memory import SHARED_TOPIC_BYTES
        from pipros.net.shared_segment import map_segment

        if not 0 < frame.second <= _SLOTS or not 0 < frame.first * frame.second <= SHARED_TOPIC_BYTES:
            raise NoSharedMemory(f"shared memory of {frame.second} times {frame.first} bytes was announced")
        descriptors = [self._sock.take_descriptor()]
        try:
            if self._pipe is None:
                descriptors.append(self._sock.take_descriptor())
                self._pipe = AcknowledgementPipe(descriptors[1])
            self._memory = map_segment(descriptors[0], frame.first, frame.second)
        except (OSError, ProtocolError) as error:
            raise NoSharedMemory(f"shared memory is not used: {error}") from error
        finally:
            for descriptor in descriptors:
                os.close(descriptor)
        self._segment = frame


_pipes: weakref.WeakSet[AcknowledgementPipe] = weakref.WeakSet()


def _close_in_children(pipe: AcknowledgementPipe) -> None:
    """Keep forked processes from returning the slots of their parent."""
    _register()
    _pipes.add(pipe)


@cache
def _register() -> None:
    call_in_children(_close_pipes)


def _close_pipes() -> None:
    for pipe in _pipes:
        pipe.close()
