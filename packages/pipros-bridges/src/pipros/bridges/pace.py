"""Rate limits for the messages from one client of a bridge. Performs no I/O.

Theory of operation. Messages and bytes per second have fixed limits. The processor time of a single client is
not limited, so that it can publish as fast as the machine allows. If several clients keep the server busy,
each gets an equal part of `BUSY_SHARE` of one processor, because Python runs one thread at a time: otherwise,
a client that sends a request now and then would wait for every busy client, several times per request.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Final

from pipros.basics.limits import Limits
from pipros.bridges.limits import BridgeLimits

BURST_S: Final = 1.0
"""A client may send in one burst as much as the limits allow for this time."""
BUSY_SHARE: Final = 0.8
"""Part of one processor that several busy clients share."""
BUSY_S: Final = 0.03
"""A client is busy if its recent processor time (s) exceeds this. The recent time is a sum that decays
exponentially, with a time constant of one second.
"""


class SharedWork:
    """The clients that keep a server busy. For use in one thread."""

    def __init__(self) -> None:
        self._busy_until_s: dict[int, float] = {}

    def count(self, client: int, until_s: float, now_s: float) -> int:
        """Record that a client is busy until `until_s`. Return the number of clients that are busy now."""
        if until_s > now_s:
            self._busy_until_s[client] = until_s
        if len(self._busy_until_s) > 1:
            self._busy_until_s = {key: end for key, end in self._busy_until_s.items() if end > now_s}
        return len(self._busy_until_s)


class ReadPace:
    """Computes how long to wait before reading a client's next message.

    The connection's buffers fill up during the delay, so a client that sends too much is slowed down; no
    message is stored or dropped. For each limit, the next message is due when a client that sends at exactly
    the permitted rate would have sent the same amount.
    """

    def __init__(
        self, limits: Limits, clock: Callable[[], float] = time.monotonic, work: SharedWork | None = None
    ) -> None:
        """Create the rate limits for a new client.

        Args:
            clock: returns the time in seconds.
            work: the busy clients of the server.
        """
        self._message_s = 1 / limits.of(BridgeLimits).bridge_client_rate
        self._byte_s = 1 / limits.of(BridgeLimits).bridge_client_rate_bytes
        self._clock = clock
        self._work = work or SharedWork()
        self._due_by_messages_s = self._due_by_bytes_s = self._due_by_work_s = clock() - BURST_S
        self._worked_s = self._recent_s = 0.0
        self._noted_s = clock()

    def delay_s(self, size: int, worked_s: float = 0.0) -> float:
        """Count a message of `size` bytes. Return the delay (s), 0.0 if the client stays within the limits.

        `worked_s` is the processor time that all messages of the client have taken so far.
        """
        now_s = self._clock()
        earliest_s = now_s - BURST_S
        self._due_by_messages_s = max(self._due_by_messages_s, earliest_s) + self._message_s
        self._due_by_bytes_s = max(self._due_by_bytes_s, earliest_s) + self._byte_s * size
        self._count_work(worked_s - self._worked_s, now_s)
        self._worked_s = worked_s
        due_s = max(self._due_by_messages_s, self._due_by_bytes_s, self._due_by_work_s)
        return max(due_s - now_s, 0.0)

    def _count_work(self, work_s: float, now_s: float) -> None:
        self._recent_s = self._recent_s * math.exp(self._noted_s - now_s) + work_s
        self._noted_s = now_s
        is_busy_s = math.log(self._recent_s / BUSY_S) if self._recent_s > BUSY_S else 0.0
        count = self._work.count(id(self), now_s + is_busy_s, now_s)
        self._due_by_work_s = max(self._due_by_work_s, now_s - BURST_S)
        self._due_by_work_s += work_s * (count / BUSY_SHARE if count > 1 else 1.0)
