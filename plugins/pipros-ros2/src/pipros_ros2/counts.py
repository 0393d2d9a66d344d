"""Count the messages, calls and goals that a gateway's topic, service or action forwards and drops."""

from __future__ import annotations

import logging
from collections.abc import Hashable

_LOG = logging.getLogger("pipros_ros2")


class Counts:
    """Counters of one topic, service or action since the gateway opened it.

    Attributes:
        passed: number of messages or calls that were forwarded, or of goals that arrived.
        failed: number of messages, calls or goals that could not be converted or forwarded.
        overflowed: number of messages or calls that were dropped because a queue was full.
        reason: reason for the last drop; empty if there was none.
    """

    def __init__(self) -> None:
        self.passed = self.failed = self.overflowed = 0
        self.reason = ""
        self._queues: dict[Hashable, int] = {}

    @property
    def dropped(self) -> int:
        return self.failed + self.overflowed

    def fail(self, reason: object) -> None:
        """Count a failure, and log the reason if it has changed."""
        self.failed += 1
        if self.reason != str(reason):
            self.reason = str(reason)
            _LOG.warning("%s", reason)

    def overflow(self, queue: Hashable, total: int, reason: str) -> None:
        """Count a queue's drops, and log the reason the first time. Call this in one thread only.

        Args:
            queue: identifies the queue. If it is replaced, its total starts at 0 again.
            total: number of messages or calls that the queue has dropped so far.
        """
        before = self._queues.get(queue, 0)
        self._queues[queue] = total
        new = total - before if total >= before else total
        if new:
            if not self.overflowed:
                _LOG.warning("%s", reason)
            self.overflowed += new
            self.reason = reason
