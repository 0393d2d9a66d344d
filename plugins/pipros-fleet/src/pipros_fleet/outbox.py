"""Queue of messages for the link, with rates, priorities and a bandwidth limit. Uses no clock and no lock."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, Generic, TypeVar

from pipros_fleet.fleet_rules import FleetRule, Priority

Item = TypeVar("Item")

QUEUE: Final = 100
"""Maximum number of queued messages per topic, for topics that send all messages."""
BURST_S: Final = 0.1
"""Maximum size of a burst, given as its transfer time at the limited bandwidth."""
_ORDER: Final = {Priority.HIGH: 0, Priority.NORMAL: 1, Priority.LOW: 2}


@dataclass(slots=True)
class _QueuedTopic(Generic[Item]):
    rank: int
    interval_s: float
    queue_size: int
    next_s: float = 0.0
    waiting: deque[tuple[Item, int]] = field(default_factory=deque)


class FleetOutbox(Generic[Item]):
    """Queue that selects the next message to send, and drops messages beyond its limits.

    A topic with a rate limit queues only its newest message until the topic is due, so the last message of a
    burst is always sent. Topics with a higher priority are sent first, and topics with the same priority take
    turns. Messages with high priority consume bandwidth but do not wait for it.

    Attributes:
        dropped: number of dropped messages, by topic.
        bytes: size of all queued messages.
    """

    def __init__(self, limit_bytes: int, bandwidth_kbit: float = 0.0) -> None:
        """Create an empty queue for up to `limit_bytes` of messages. A bandwidth of 0 means no limit."""
        self.dropped: dict[str, int] = {}
        self.bytes = 0
        self._limit_bytes = limit_bytes
        self._bytes_per_s = bandwidth_kbit * 1000 / 8
        self._credit = self._bytes_per_s * BURST_S
        self._credited_s = 0.0
        self._topics: dict[str, _QueuedTopic[Item]] = {}

    def add_topic(self, name: str, rule: FleetRule) -> None:
        """Add a topic, or change its rule. Queued messages are kept."""
        queue_size = 1 if rule.is_latest_only or rule.rate_hz else QUEUE
        topic: _QueuedTopic[Item] = _QueuedTopic(
            _ORDER[rule.priority], 1 / rule.rate_hz if rule.rate_hz else 0.0, queue_size
        )
        if before := self._topics.get(name):
            topic.waiting, topic.next_s = before.waiting, before.next_s
        self._topics[name] = topic

    def remove_topic(self, name: str) -> None:
        """Remove a topic and its queued messages."""
        topic = self._topics.pop(name, None)
        if topic is not None:
            self.bytes -= sum(size for _, size in topic.waiting)

    def is_idle(self, name: str) -> bool:
        """Return whether a message of the topic may be sent immediately, without `push`."""
        topic = self._topics.get(name)
        return topic is not None and not topic.interval_s and not topic.waiting and not self._bytes_per_s

    def is_unlimited(self, name: str) -> bool:
        """Return whether all of a topic's messages are sent, without a rate or bandwidth limit."""
        topic = self._topics.get(name)
        return topic is not None and topic.queue_size == QUEUE and not self._bytes_per_s

    def push(self, name: str, item: Item, size: int) -> None:
        """Queue a message, dropping older messages to make room.

        Messages of unknown topics and messages larger than the limit are dropped.
        """
        topic = self._topics.get(name)
        if topic is None or size > self._limit_bytes:
            self._drop(name)
            return
        while len(topic.waiting) >= topic.queue_size:
            self._drop_oldest(name, topic)
        topic.waiting.append((item, size))
        self.bytes += size
        while self.bytes > self._limit_bytes:
            last = max(self._waiting(), key=lambda pair: (pair[1].rank, len(pair[1].waiting)))
            self._drop_oldest(*last)

    def pop(self, now_s: float) -> tuple[str, Item] | None:
        """Remove and return the next message that is due, with its topic, or None if no message is due."""
        self._earn(now_s)
        ready = [
            (topic.rank, topic.next_s, name)
            for name, topic in self._waiting()
            if topic.next_s <= now_s and self._debt_s(topic) <= 0
        ]
        if not ready:
            return None
        name = min(ready)[2]
        topic = self._topics[name]
        item, size = topic.waiting.popleft()
        topic.next_s = now_s + topic.interval_s
        self.bytes -= size
        self._credit -= size
        return name, item

    def wait_s(self, now_s: float) -> float | None:
        """Return the time in s until a message is due, or None if no message is queued."""
        self._earn(now_s)
        waits = [max(topic.next_s - now_s, self._debt_s(topic), 0.0) for _, topic in self._waiting()]
        return min(waits, default=None)

    def _debt_s(self, topic: _QueuedTopic[Item]) -> float:
        """Return the time in s until the bandwidth permits another message; 0 or less if it already does."""
        if not self._bytes_per_s or topic.rank == 0:
            return 0.0
        return -self._credit / self._bytes_per_s

    def _waiting(self) -> Iterator[tuple[str, _QueuedTopic[Item]]]:
        return ((name, topic) for name, topic in self._topics.items() if topic.waiting)

    def _earn(self, now_s: float) -> None:
        if self._bytes_per_s:
            earned = (now_s - self._credited_s) * self._bytes_per_s
            self._credit = min(self._credit + earned, self._bytes_per_s * BURST_S)
        self._credited_s = now_s

    def _drop_oldest(self, name: str, topic: _QueuedTopic[Item]) -> None:
        self.bytes -= topic.waiting.popleft()[1]
        self._drop(name)

    def _drop(self, name: str) -> None:
        self.dropped[name] = self.dropped.get(name, 0) + 1
