"""Detect bursts of messages, during which several messages should share a packet.

Sending and receiving a packet takes several times as long as processing a small message, so a packet per
message would limit the rate of a burst. Outside bursts, no message may wait for others.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from pipros.net.loop import BackgroundLoop

if TYPE_CHECKING:
    from pipros.net.outgoing import OutgoingLink

PACKET_SHARING_BYTES: Final = 8 * 1024
"""Messages up to this size share packets when they follow each other closely."""

CLOSE_S: Final = 200e-6
"""Messages at shorter intervals than this, that is, at more than 5,000 per second, follow each other closely.
"""

RUN_LENGTH: Final = 32
LATE: Final = 8
"""A burst begins when a counter reaches RUN_LENGTH and ends when it falls to 0. A message that closely
follows another adds 1 to the counter; a late message subtracts LATE. A single late message, whose publisher
may have waited for a processor, therefore does not end a burst.
"""

SILENCE_S: Final = 1e-3
"""A pause of this length ends a burst even if no further message follows."""

CHECK_S: Final = 0.001
"""Interval at which the event loop sends collected messages, and checks whether a burst has ended."""


class BurstDetector:
    """Detects bursts of messages on one topic, using a monotonic clock. Not thread-safe.

    Attributes:
        in_burst: whether a burst is in progress.
        is_close: whether the last message closely followed another.
    """

    __slots__ = ("_last_s", "_length", "in_burst", "is_close")

    def __init__(self) -> None:
        self.in_burst = self.is_close = False
        self._length = 0
        self._last_s = float("-inf")

    def note(self, now_s: float) -> bool:
        """Count a message that is about to be sent. Return True if this changes `in_burst`."""
        self.is_close, self._last_s = now_s - self._last_s < CLOSE_S, now_s
        if self.is_close:
            if self._length == RUN_LENGTH:
                return False
            self._length += 1
            changes = not self.in_burst and self._length == RUN_LENGTH
        else:
            self._length = max(0, self._length - LATE)
            changes = self.in_burst and not self._length
        if changes:
            self.in_burst = not self.in_burst
        return changes

    def end_if_idle(self, now_s: float) -> bool:
        """End the burst if there has been no message for SILENCE_S. Return True if a burst ended."""
        if self.in_burst and now_s - self._last_s >= SILENCE_S:
            self.in_burst = False
            self._length = 0
            return True
        return False


class PacketSharing:
    """Makes a topic's links share packets during bursts.

    Except for `close`, all methods are called while holding the lock that keeps the topic's messages in
    order.

    Attributes:
        note: `BurstDetector.note`. If it returns True, the caller must call `apply`. It is an attribute for
            speed, because it is called for every small message.
        detector: the state of the current burst.
    """

    __slots__ = ("_flush", "_is_closed", "_is_watched", "_links", "_lock", "_loop", "detector", "note")

    def __init__(
        self,
        loop: BackgroundLoop,
        lock: threading.Lock,
        links: Callable[[], Iterable[OutgoingLink]],
        flush: Callable[[], object],
    ) -> None:
        """Start without a burst.

        Args:
            loop: the event loop that watches bursts.
            lock: the lock that keeps the topic's messages in order.
            links: returns the topic's current links.
            flush: sends the messages that the topic has collected; called in the loop with the lock held.
        """
        self.detector = BurstDetector()
        self.note = self.detector.note
        self._flush = flush
        self._loop = loop
        self._lock = lock
        self._links = links
        self._is_watched = False  # whether the event loop is watching a burst
        self._is_closed = False

    def apply_to(self, link: OutgoingLink) -> None:
        """Make a new link share packets if the other links do."""
        link.share_packets(share=self.detector.in_burst)

    def apply(self) -> None:
        """Make all links share packets if a burst is in progress; otherwise, make them stop."""
        in_burst = self.detector.in_burst
        for link in self._links():
            link.share_packets(share=in_burst)
        if in_burst and not self._is_watched:
            self._is_watched = True
            self._loop.call(self._watch)

    def close(self) -> None:
        """Stop watching the current burst."""
        self._is_closed = True

    def _watch(self) -> None:
        """Send collected messages, and end a burst that is over. Runs in the event loop; does not block."""
        if self._lock.acquire(blocking=False):  # skip the check while a message is being published
            try:
                self._flush()
                if self.detector.end_if_idle(time.monotonic()):
                    self.apply()
                self._is_watched = self.detector.in_burst and not self._is_closed
                if not self._is_watched:
                    return  # the next burst starts its own watch
            finally:
                self._lock.release()
        self._loop.asyncio.call_later(CHECK_S, self._watch)
