"""What a topic, service or action of a gateway has passed and dropped."""

from __future__ import annotations

import logging
from collections.abc import Hashable

_LOG = logging.getLogger("pipros.ros2")


class Counts:
    """Messages, calls or goals since the gateway opened their topic, service or action.

    Attributes:
        passed: number of messages and calls that were passed, or of goals that arrived.
        failed: number that could not be converted or passed.
        overflowed: number that full queues dropped.
        reason: why the last one was dropped, or empty.
    """

    def __init__(self) -> None:
        self.passed = self.failed = self.overflowed = 0
        self.reason = ""
        self._queues: dict[Hashable, int] = {}

    @property
    def dropped(self) -> int:
        return self.failed + self.overflowed

    def fail(self, reason: object) -> None:
        """Count one that cannot be passed, and log the reason if it has changed."""
        self.failed += 1
        if self.reason != str(reason):
            self.reason = str(reason)
            _LOG.warning("%s", reason)

    def overflow(self, queue: Hashable, total: int, reason: str) -> None:
        """Count what a queue has dropped, and log the first time. Call this in one thread only.

        Args:
            queue: identifies the queue. If it is replaced, its total starts at 0 again.
            total: number that the queue has dropped.
        """
        before = self._queues.get(queue, 0)
        self._queues[queue] = total
        new = total - before if total >= before else total
        if new:
            if not self.overflowed:
                _LOG.warning("%s", reason)
            self.overflowed += new
            self.reason = reason
