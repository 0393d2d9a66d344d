"""Rate limits for the messages from one client of a bridge. Performs no I/O.

Messages and bytes per second have fixed limits. For processor time, see `pipros_server.loop_share`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from pipros.basics.limits import Limits
from pipros_bridges.limits import BridgeLimits

BURST_S: Final = 1.0
"""A client may send in one burst as much as the limits allow for this time."""


class ReadPace:
    """Computes how long to wait before reading a client's next message.

    The connection's buffers fill up during the delay, so a client that sends too much is slowed down; no
    message is stored or dropped. For each limit, the next message is due when a client that sends at exactly
    the permitted rate would have sent the same amount.
    """

    def __init__(self, limits: Limits, clock: Callable[[], float] = time.monotonic) -> None:
        """Create the rate limits for a new client. `clock` returns the time in seconds."""
        self._message_s = 1 / limits.of(BridgeLimits).bridge_client_rate
        self._byte_s = 1 / limits.of(BridgeLimits).bridge_client_rate_bytes
        self._clock = clock
        self._due_by_messages_s = self._due_by_bytes_s = clock() - BURST_S

    def delay_s(self, size: int) -> float:
        """Count a message of `size` bytes. Return the delay (s), 0.0 if the client keeps the limits."""
        now_s = self._clock()
        earliest_s = now_s - BURST_S
        self._due_by_messages_s = max(self._due_by_messages_s, earliest_s) + self._message_s
        self._due_by_bytes_s = max(self._due_by_bytes_s, earliest_s) + self._byte_s * size
        return max(self._due_by_messages_s, self._due_by_bytes_s, now_s) - now_s
