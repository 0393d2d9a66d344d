"""Tells when messages follow each other so closely that they should share packets.

A packet costs both sides several times what a small message costs: in a dense run, sending each in a
packet of its own limits the rate. Alone, a message must not wait for others.
"""

from __future__ import annotations

from typing import Final

#: Messages closer than this belong together: at 5,000 a second and more.
CLOSE_S: Final = 200e-6

#: So many close ones make a dense run. One that is late, because its publisher had to wait for a
#: processor, counts as LATE of them: a few in a row end the run.
RUN_LENGTH: Final = 32
LATE: Final = 8

#: A silence of this length ends a dense run without a further message.
SILENCE_S: Final = 1e-3


class Pace:
    """Of the messages of one topic, by a clock that only advances. For one thread at a time.

    Attributes:
        is_dense: whether a dense run goes on.
    """

    __slots__ = ("_last_s", "_length", "is_dense")

    def __init__(self) -> None:
        self.is_dense = False
        self._length = 0
        self._last_s = float("-inf")

    def note(self, now_s: float) -> bool:
        """Takes note of a message that is about to be sent; True when `is_dense` changes with it."""
        is_close, self._last_s = now_s - self._last_s < CLOSE_S, now_s
        if is_close:
            if self._length == RUN_LENGTH:
                return False
            self._length += 1
            changes = not self.is_dense and self._length == RUN_LENGTH
        else:
            self._length = max(0, self._length - LATE)
            changes = self.is_dense and not self._length
        if changes:
            self.is_dense = not self.is_dense
        return changes

    def falls_silent(self, now_s: float) -> bool:
        """Ends a dense run that was silent for SILENCE_S; True when it did."""
        if self.is_dense and now_s - self._last_s >= SILENCE_S:
            self.is_dense = False
            self._length = 0
            return True
        return False
