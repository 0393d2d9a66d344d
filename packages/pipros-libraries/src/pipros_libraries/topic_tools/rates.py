"""Rules that decide which messages on a topic pass, by rate, by bandwidth or by count.

Call `passes` once for every message, in order, from one thread at a time. Times are in nanoseconds; all
calls must use the same clock.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

_SECOND = 1_000_000_000


class RateRule(Protocol):
    """A rule that decides whether the next message passes."""

    @property
    def has_gone_back(self) -> bool:
        """Whether the last call to `passes` detected a backward clock jump. Some rules never detect one."""

    def passes(self, now_ns: int, size_bytes: int) -> bool: ...


@dataclass(slots=True)
class MessageRate:
    """Lets a message pass if more than 1/`per_second` seconds have elapsed since the previous one passed.

    If the clock jumps back because a bag was restarted, the interval starts again at the new time.

    >>> rule = MessageRate(1.0)
    >>> [rule.passes(int(s * 1e9), 0) for s in (5, 5.5, 6.1, 6.2)]
    [True, False, True, False]
    """

    per_second: float
    has_gone_back: bool = False
    """Whether the clock had jumped back at the last call to `passes`."""
    _last_ns: int = 0

    def passes(self, now_ns: int, size_bytes: int) -> bool:
        del size_bytes
        self.has_gone_back = now_ns < self._last_ns
        if self.has_gone_back:
            self._last_ns = now_ns
        if now_ns - self._last_ns <= _SECOND / self.per_second:
            return False
        self._last_ns = now_ns
        return True


@dataclass(slots=True)
class ByteRate:
    """Lets a message pass if fewer than `size` bytes have passed in the last `window_s` seconds.

    As in Noetic's `throttle`, `size` (BYTES_PER_SEC) is the total for the window, not divided by the window's
    length.

    >>> rule = ByteRate(10.0, window_s=1.0)
    >>> [rule.passes(int(s * 1e9), 8) for s in (5, 5.1, 5.2, 6.15)]
    [True, True, False, True]
    """

    size: float
    window_s: float
    has_gone_back: ClassVar[bool] = False
    """Noetic reports clock jumps only for `MessageRate`."""
    _passed: deque[tuple[int, int]] = field(default_factory=deque)
    _bytes: int = 0

    def passes(self, now_ns: int, size_bytes: int) -> bool:
        if self._passed and now_ns < self._passed[-1][0]:  # the clock has jumped back
            self._passed.clear()
            self._bytes = 0
        while self._passed and self._passed[0][0] < now_ns - self.window_s * _SECOND:
            self._bytes -= self._passed.popleft()[1]
        if self._bytes >= self.size:
            return False
        self._passed.append((now_ns, size_bytes))
        self._bytes += size_bytes
        return True


@dataclass(slots=True)
class Dropping:
    """Drops the first `dropped` messages out of every `of` messages.

    >>> rule = Dropping(1, of=3)
    >>> [rule.passes(0, 0) for _ in range(6)]
    [False, True, True, False, True, True]
    """

    dropped: int
    of: int
    _count: int = 0

    def passes(self, now_ns: int, size_bytes: int) -> bool:
        del now_ns, size_bytes
        place, self._count = self._count, (self._count + 1) % self.of
        return place >= self.dropped
