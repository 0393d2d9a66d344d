"""The known types of topics that no node publishes or subscribes to any more."""

from __future__ import annotations

from pipros.basics.limits import Limits


class UnusedTypes:
    """Topics with a known type but no publishers or subscribers, ordered by when they became unused.

    >>> unused = UnusedTypes(Limits(topic_types=2))
    >>> unused.add("/a", "x/Y"), unused.add("/b", "x/Y"), unused.add("/c", "x/Y")
    ([], [], ['/a'])
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._bytes_of: dict[str, int] = {}
        self._bytes = 0

    def add(self, topic: str, type_name: str) -> list[str]:
        """Add a topic that became unused; return the topics whose types must be discarded."""
        self.remove(topic)
        self._bytes_of[topic] = size = len(topic) + len(type_name)
        self._bytes += size
        forgotten = []
        while len(self._bytes_of) > self._limits.topic_types or self._bytes > self._limits.topic_type_bytes:
            oldest = next(iter(self._bytes_of))
            self.remove(oldest)
            forgotten.append(oldest)
        return forgotten

    def remove(self, topic: str) -> None:
        """Remove a topic that is in use again, or whose type was discarded."""
        self._bytes -= self._bytes_of.pop(topic, 0)
