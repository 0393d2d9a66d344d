"""Flush the links to all subscribers of a topic in parallel."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import TYPE_CHECKING

from pipros.net import sockets

if TYPE_CHECKING:
    from pipros.net.outgoing import OutgoingLink

LARGE_MESSAGE_WAIT_S = 0.0005
"""How long a publisher with a queue waits for a subscriber that is reading, in order to send the rest of a
large message. The publisher does not wait again for a subscriber that did not read, until this subscriber has
caught up.
"""

LARGE_MESSAGES_WAIT_S = 0.02
"""Maximum total duration of these waits in one call. The event loop sends the rest."""

WATCH_CLOSE_S = 0.1
"""Interval at which a wait checks whether links were closed."""


def flush_or_queue(links: Iterable[OutgoingLink], limit_s: float) -> None:
    """Send as many of the links' queued messages as possible; the event loop sends the rest.

    Blocks for at most `limit_s` in total. Does not wait for stalled links. During the wait, every link is
    written to as soon as it is writable, so that links do not wait for each other.
    """
    now = time.monotonic()
    deadlines: dict[OutgoingLink, float] = {}
    for link in links:
        if not link.is_behind:
            continue
        if link.is_waited_for:
            deadlines[link] = now + limit_s
        elif link.is_briefly_waited_for:
            deadlines[link] = now + min(limit_s, LARGE_MESSAGE_WAIT_S)
        else:
            link.queue_for_loop()
    last_deadline = now + min(limit_s, LARGE_MESSAGES_WAIT_S)
    while deadlines:
        pause_s = min(WATCH_CLOSE_S, max(0.0, min(deadlines.values()) - now))
        ready = sockets.wait_any_writable([link.sock for link in deadlines], pause_s)
        now = time.monotonic()
        for link, deadline in list(deadlines.items()):
            if link.sock in ready and link.flush() and not link.is_waited_for:
                deadline = deadlines[link] = min(now + LARGE_MESSAGE_WAIT_S, last_deadline)
            if not link.is_behind:
                del deadlines[link]
            elif now >= deadline:
                link.stop_waiting()
                del deadlines[link]
