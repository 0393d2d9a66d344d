"""Delays and timeouts of links. Programs use the defaults; tests and special networks change them."""

from __future__ import annotations

import time
from typing import NamedTuple

_TICKS_BEGAN = time.monotonic()


def to_tick_s(every_s: float) -> float:
    """Return the seconds to a tick of this process: about `every_s`, from half of it to one and a half.

    What a process does from time to time it does at ticks, together, so that it wakes once.
    """
    return every_s * (1.5 - ((time.monotonic() - _TICKS_BEGAN) / every_s + 0.5) % 1.0)


class LinkTimings(NamedTuple):
    """Delays and timeouts of the connections between two nodes.

    Attributes:
        keepalive_idle_s: time after which an idle connection is probed.
        keepalive_interval_s: interval between probes.
        keepalive_count: number of unanswered probes after which the system closes the connection.
        unanswered_s: time after which a peer that does not acknowledge data is considered lost. It equals
            the time that the probes of an idle connection take.
        check_peer_interval_s: interval between checks for such peers.
        slow_delivery_s: after a delivery that takes longer, the socket is read again. A smaller value would
            slow down fast callbacks.
        turn_s: how long a link may deliver before the topic's other links get the lock. (Passing the lock on
            after each message would cost more than delivering the messages.)
        drain_limit_s: how long reading may continue if the peer sends faster than the link reads.
        quiet_s: how long reading continues without new data if the socket was full. (A full socket closes its
            TCP window, so the peer has more data to send.)
        keep_memory_s: time without large messages after which a topic's shared memory is freed.
    """

    keepalive_idle_s: int = 20
    keepalive_interval_s: int = 5
    keepalive_count: int = 4
    unanswered_s: float = 20 + 5 * 4
    check_peer_interval_s: float = 5.0
    slow_delivery_s: float = 0.001
    turn_s: float = 0.001
    drain_limit_s: float = 0.1
    quiet_s: float = 0.002
    keep_memory_s: float = 5.0


LINK_TIMINGS = LinkTimings()
"""The defaults."""
