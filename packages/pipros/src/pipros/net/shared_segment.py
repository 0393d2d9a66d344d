"""Segments of memory that a publisher shares with its subscribers. Linux only.

A segment is an anonymous file (`memfd_create`), divided into equal slots. Once the publisher has mapped it,
seals make the kernel refuse all other writable mappings, writes and changes of its size. A reader can
therefore neither change a message that others read, nor be killed by SIGBUS because the memory has shrunk.
The memory exists as long as any process maps it or holds its descriptor.

The kernel allocates a page when it is first written to, and kills the writer with SIGBUS if no memory is
left. Each slot is therefore allocated explicitly before its first use, which fails with an error instead.
"""

from __future__ import annotations

import mmap
import os
import sys
from collections.abc import Sequence
from typing import Final

from pipros.basics.errors import ProtocolError
from pipros.net.backlog import Buffer

_FUTURE_WRITE: Final = 0x10
"""F_SEAL_FUTURE_WRITE, which the module `fcntl` lacks. Linux has supported it since version 5.1."""

_CHUNK_BYTES: Final = 1024 * 1024
"""Other threads can run after this many bytes of a copy."""


class Segment:
    """The publisher's end of a segment. Not thread-safe.

    Attributes:
        number, slot_bytes, slots: see `pipros.wire.slot_frames`.
        counted: the slots that count in the limits: those that were used, and may take memory.
        descriptor: the file descriptor to pass to subscribers.
    """

    def __init__(self, number: int, slot_bytes: int, slots: int) -> None:
        """Create the memory.

        Raises:
            OSError: the system lacks `memfd_create`, or no descriptors or memory are left.
        """
        self.number, self.slot_bytes, self.slots = number, slot_bytes, slots
        self.counted: set[int] = set()
        self._memory: mmap.mmap
        self._view: memoryview
        if sys.platform != "linux" or not hasattr(os, "memfd_create"):
            raise OSError("this system cannot share memory without a name")
        import fcntl

        self._allocated = [0] * slots
        self.descriptor: int = os.memfd_create("pipros", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(self.descriptor, self.size)
            self._memory = mmap.mmap(self.descriptor, self.size)  # stays writable after sealing
            seals = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL | _FUTURE_WRITE
            fcntl.fcntl(self.descriptor, fcntl.F_ADD_SEALS, seals)
        except BaseException:
            os.close(self.descriptor)
            raise
        self._view = memoryview(self._memory)

    @property
    def size(self) -> int:
        return self.slot_bytes * self.slots

    @property
    def counted_bytes(self) -> int:
        return self.slot_bytes * len(self.counted)

    def allocate(self, index: int, size: int) -> None:
        """Allocate the first `size` bytes of a slot.

        Raises:
            OSError: no memory is left.
        """
        if sys.platform == "linux" and size > self._allocated[index]:
            os.posix_fallocate(self.descriptor, index * self.slot_bytes, size)
            self._allocated[index] = size

    def write(self, index: int, message: Sequence[Buffer]) -> None:
        """Copy a message into an allocated slot."""
        offset, view = index * self.slot_bytes, self._view
        for buffer in message:
            whole = memoryview(buffer).cast("B")
            for start in range(0, len(whole), _CHUNK_BYTES):
                part = whole[start : start + _CHUNK_BYTES]
                view[offset : offset + len(part)] = part
                offset += len(part)

    def close(self) -> None:
        """Unmap the memory and close the descriptor. May be called repeatedly.

        The memory is freed once no subscriber maps it.
        """
        if self.descriptor >= 0:
            self._view.release()
            self._memory.close()
            os.close(self.descriptor)
            self.descriptor = -1


def map_segment(descriptor: int, slot_bytes: int, slots: int) -> mmap.mmap:
    """Map a segment for reading. The caller closes the descriptor.

    The memory is freed when nothing refers to the result any more.

    Raises:
        ProtocolError: the memory is smaller than announced, or is not sealed against shrinking.
        OSError: the memory cannot be mapped.
    """
    if sys.platform != "linux":
        raise OSError("this system cannot share memory without a name")
    import fcntl

    try:
        seals = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS)
    except OSError:
        raise ProtocolError("the shared memory is not a file that can be sealed") from None
    if not seals & fcntl.F_SEAL_SHRINK:
        raise ProtocolError("the shared memory could shrink")
    size = slot_bytes * slots
    if os.fstat(descriptor).st_size < size:
        raise ProtocolError(f"the shared memory has fewer than the {size} bytes that were announced")
    return mmap.mmap(descriptor, size, prot=mmap.PROT_READ)
