"""Convert between bag time and the machine's time, taking the rate, pauses and skips into account.

Callers pass in the machine's time.
"""

from __future__ import annotations


class PlaybackClock:
    """Converter between bag time and monotonic time, both in nanoseconds.

    Args:
        bag_ns: bag time at the start of playback.
        now_ns: monotonic time at the start of playback.
        rate: nanoseconds of bag time per nanosecond of monotonic time.

    >>> clock = PlaybackClock(100, 0, 2.0)
    >>> clock.due(110), clock.bag_time(5)
    (5, 110)
    """

    def __init__(self, bag_ns: int, now_ns: int, rate: float = 1.0) -> None:
        self._bag = bag_ns
        self._now = now_ns
        self._rate = rate
        self._paused_at: int | None = None

    @property
    def is_paused(self) -> bool:
        return self._paused_at is not None

    def due(self, bag_ns: int) -> int:
        """Return the monotonic time at which a bag time is due.

        This method must not be called during a pause.
        """
        return self._now + round((bag_ns - self._bag) / self._rate)

    def bag_time(self, now_ns: int) -> int:
        """Return the current bag time, which does not advance during a pause."""
        at = now_ns if self._paused_at is None else self._paused_at
        return self._bag + round((at - self._now) * self._rate)

    def pause(self, now_ns: int) -> None:
        if self._paused_at is None:
            self._paused_at = now_ns

    def resume(self, now_ns: int) -> None:
        if self._paused_at is not None:
            self._now += now_ns - self._paused_at
            self._paused_at = None

    def jump(self, bag_ns: int, now_ns: int) -> None:
        """Jump to another bag time. A paused clock stays paused."""
        self._bag, self._now = bag_ns, now_ns
        if self._paused_at is not None:
            self._paused_at = now_ns
