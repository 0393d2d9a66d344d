"""Return memory to the system after clients have left.

Threads that parse large messages each get an arena from glibc's allocator. Each arena may keep free memory at
its end, as much as two of the largest messages need, and `malloc_trim` returns this part only for the main
arena. Therefore, all threads share the main arena. Sharing costs little, because Python runs one thread at a
time. Without glibc, only the garbage is collected.

The objects of a client form reference cycles, which Python by itself collects only after many new objects
have been created. Therefore, the garbage is collected first.
"""

from __future__ import annotations

import asyncio
import ctypes
import gc
import sys
from typing import Final

LARGE_BYTES: Final = 1024 * 1024
"""Minimum traffic of departed clients that makes returning their memory worthwhile."""
MESSAGE_BYTES: Final = 1024
"""Memory that a message can leave behind besides its data."""
DELAY_S: Final = 3.0
"""Time (s) for a client's threads to finish, and for other clients to leave."""
_ARENA_MAX: Final = -8
"""`M_ARENA_MAX` in glibc's malloc.h."""


def _glibc() -> ctypes.CDLL | None:
    """Return the C library if it is glibc."""
    library = ctypes.CDLL(None) if sys.platform == "linux" else None
    return library if hasattr(library, "malloc_trim") else None


def share_one_arena() -> None:
    """Let all threads that start later allocate from one arena. Call before the first thread starts."""
    glibc = _glibc()
    if glibc is not None:
        glibc.mallopt(_ARENA_MAX, 1)


class FreedMemory:
    """Returns free memory after clients have left. For use in one event loop."""

    def __init__(self) -> None:
        self._glibc = _glibc()
        self._left_bytes = 0
        self._is_due = False

    def note_left(self, traffic_bytes: int, messages: int) -> None:
        """Count the traffic of a client that has left. Return free memory soon if the total is large."""
        self._left_bytes += traffic_bytes + messages * MESSAGE_BYTES
        if not self._is_due and self._left_bytes >= LARGE_BYTES:
            self._is_due = True
            asyncio.get_running_loop().call_later(DELAY_S, self._trim)

    def _trim(self) -> None:
        self._left_bytes = 0
        self._is_due = False
        gc.collect()
        if self._glibc is not None:
            self._glibc.malloc_trim(0)
