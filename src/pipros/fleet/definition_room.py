"""Memory limit for the definitions of other members' messages."""

from __future__ import annotations

import threading


class DefinitionRoom:
    """Limits the memory used by all members' definitions. Thread-safe."""

    def __init__(self, limit_bytes: int) -> None:
        self._limit_bytes = limit_bytes
        self._used_bytes = 0
        self._lock = threading.Lock()

    def take(self, size_bytes: int) -> bool:
        """Reserve memory. Return False, and reserve nothing, if too little is left."""
        with self._lock:
            has_room = self._used_bytes + size_bytes <= self._limit_bytes
            self._used_bytes += size_bytes * has_room
            return has_room

    def give_back(self, size_bytes: int) -> None:
        """Release memory for which `take` returned True."""
        with self._lock:
            self._used_bytes -= size_bytes
