"""Detects when messages follow each other so closely that they should share packets.

A packet costs both sides several times what a small message costs: in a burst, sending each message in a
packet of its own limits the rate. Outside a burst, a message must not wait for others.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from typing import Final, Protocol

from pipros.net.loop import BackgroundLoop

SHARED_BYTES: Final = 8 * 1024
"""Messages up to this size share packets when they follow each other closely."""

CLOSE_S: Final = 200e-6
"""Messages closer than this belong together: at 5,000 a second and more."""

RUN_LENGTH: Final = 32
LATE: Final = 8
"""So many close ones make a burst. One that is late, because its publisher had to wait for a processor,
cancels LATE of them: a few in a row end the burst."""

SILENCE_S: Final = 1e-3
"""A pause of this length ends a burst without a further message."""

CHECK_S: Final = 0.01
"""How often a burst is checked for its end: its last messages may wait this long in a shared packet when
the subscriber is slow to acknowledge those before."""


class BurstDetector:
    """Detects bursts of messages of one topic, by a monotonic clock. For one thread at a time.

    Attributes:
        in_burst: whether a burst is going on.
    """

    __slots__ = ("_last_s", "_length", "in_burst")

    def __init__(self) -> None:
        self.in_burst = False
        self._length = 0
        self._last_s = float("-inf")

    def note(self, now_s: float) -> bool:
        """Counts a message that is about to be sent; True when it changes `in_burst`."""
        is_close, self._last_s = now_s - self._last_s < CLOSE_S, now_s
        if is_close:
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
        """Ends a burst that has paused for SILENCE_S; True when it did."""
        if self.in_burst and now_s - self._last_s >= SILENCE_S:
            self.in_burst = False
            self._length = 0
            return True
        return False


class SharingLink(Protocol):
    """A link whose small frames can share packets."""

    def share_packets(self, *, share: bool) -> None: ...


class PacketSharing:
    """Has the links of one topic share packets during bursts.

    All methods but `close` are called with the lock held that keeps the frames of the topic in order.

    Attributes:
        note: as `BurstDetector.note`; when it returns True, call `apply`. An attribute, because it is called
            for every small message.
    """

    __slots__ = ("_detector", "_is_closed", "_is_watched", "_links", "_lock", "_loop", "note")

    def __init__(
        self, loop: BackgroundLoop, lock: threading.Lock, links: Callable[[], Iterable[SharingLink]]
    ) -> None:
        """`links` returns those that the topic has at the moment."""
        self._detector = BurstDetector()
        self.note = self._detector.note
        self._loop = loop
        self._lock = lock
        self._links = links
        self._is_watched = False  # by the event loop, during a burst
        self._is_closed = False

    def welcome(self, link: SharingLink) -> None:
        """Has a new link do as the others."""
        link.share_packets(share=self._detector.in_burst)

    def apply(self) -> None:
        """Makes all links share packets, or stop doing so."""
        in_burst = self._detector.in_burst
        for link in self._links():
            link.share_packets(share=in_burst)
        if in_burst and not self._is_watched:
            self._is_watched = True
            self._loop.call(self._watch)

    def close(self) -> None:
        """Ends the watch of a burst that goes on."""
        self._is_closed = True

    def _watch(self) -> None:
        """Sends the last messages of a burst when it has ended. In the event loop."""
        with self._lock:
            if self._detector.end_if_idle(time.monotonic()):
                self.apply()
            is_watched = self._is_watched = self._detector.in_burst and not self._is_closed
        if is_watched:  # by us: meanwhile the next burst may have begun, with a watch of its own
            self._loop.asyncio.call_later(CHECK_S, self._watch)
