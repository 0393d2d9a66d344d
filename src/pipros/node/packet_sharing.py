"""Detects when messages follow each other so closely that they should share packets.

A packet costs both sides several times what a small message costs: in a burst, sending each message in a
packet of its own limits the rate. Outside a burst, a message must not wait for others.
"""

from __future__ import annotations

from typing import Final

#: Messages closer than this belong together: at 5,000 a second and more.
CLOSE_S: Final = 200e-6

#: So many close ones make a burst. One that is late, because its publisher had to wait for a processor,
#: cancels LATE of them: a few in a row end the burst.
RUN_LENGTH: Final = 32
LATE: Final = 8

#: A pause of this length ends a burst without a further message.
SILENCE_S: Final = 1e-3


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
