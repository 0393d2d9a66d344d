"""Limit the total number of bytes that a server holds for its peers."""

from __future__ import annotations

from pipros.net.connection_table import TableEntry
from pipros.net.refusals import Refusals

BODIES_BYTES = 256 * 1024 * 1024
"""Limit: all incomplete XML-RPC requests to one server together; also, separately, all of a node's service
replies that clients have not read. Beyond it, the connection whose incomplete request or unread service
response is oldest is closed.
"""


class HeldBytes:
    """Counts the bytes that a server holds for its peers: incomplete messages and unread replies.

    If the limit is exceeded, the connection whose bytes have been held longest is closed; what its thread
    still reports counts nothing. Not thread-safe: use it only in the server's thread.
    """

    def __init__(self, *, limit_bytes: int, refusals: Refusals) -> None:
        self._limit_bytes = limit_bytes
        self._refusals = refusals
        self._held: dict[TableEntry, int] = {}  # oldest first
        self._closed: set[TableEntry] = set()
        self.bytes = 0

    def note(self, connection: TableEntry, count: int) -> None:
        """Record the number of bytes held for a connection."""
        if connection in self._closed:
            return
        self.bytes += count - self._held.get(connection, 0)
        self._held[connection] = count
        while self.bytes > self._limit_bytes:
            oldest = next(iter(self._held))
            self.bytes -= self._held.pop(oldest)
            self._closed.add(oldest)
            self._refusals.count(
                oldest.peer,
                "its incomplete message or unread response exceeds the memory left by other connections",
            )
            oldest.abort()

    def forget(self, connection: TableEntry) -> None:
        """Forget a connection that has closed or whose request or reply is complete. May be called again."""
        self._closed.discard(connection)
        self.bytes -= self._held.pop(connection, 0)
