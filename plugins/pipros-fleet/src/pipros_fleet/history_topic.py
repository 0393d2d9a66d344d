"""A topic that a recorder keeps: what it knows of the publishers, and their connections in the files."""

from __future__ import annotations

from typing import Final

from pipros_fleet.directory import DirectoryEntry
from pipros_fleet.messages import ReceivedMessage
from pipros_tools.bag.connection import Connection

MAX_PUBLISHERS: Final = 100
"""Maximum number of publishers per topic that are recorded separately."""


class HistoryTopic:
    """A recorded topic of one agent instance."""

    def __init__(self, member: str, entry: DirectoryEntry, instance: str, latched: dict[int, int]) -> None:
        """Create a topic. `latched` maps publishers to the sizes of their latched messages."""
        self.member = member
        self.entry = entry
        self.instance = instance
        self.latched = latched
        self.received = ReceivedMessage()
        self.definition: bytes | None = None
        self.taken_bytes = 0  # reserved for the definition
        self.is_forgotten = False
        self.connections: dict[tuple[int, bool], Connection] = {}

    def connection(self, source: int, *, is_latched: bool) -> Connection:
        """Return the connection that represents a publisher in the files.

        Publishers beyond `MAX_PUBLISHERS` share a connection.
        """
        if len(self.connections) >= MAX_PUBLISHERS and (source, is_latched) not in self.connections:
            source, is_latched = MAX_PUBLISHERS, False
        if (source, is_latched) not in self.connections:
            header = {
                "type": self.entry.type,
                "md5sum": self.entry.md5sum,
                "callerid": f"/{self.member}/{source}",
                "latching": "1" if is_latched else "0",
            }
            fields = {name: value.encode() for name, value in header.items()}
            fields["message_definition"] = self.definition or b""
            name = f"/{self.member}{self.entry.name}"
            self.connections[source, is_latched] = Connection(len(self.connections), name, fields)
        return self.connections[source, is_latched]
