"""Convert between bag time and machine time, with a rate, pauses and skips. Pure."""

from __future__ import annotations


class PlaybackClock:
    """Converts between bag time and monotonic time, both in seconds. Callers pass in the monotonic time.

    Args:
        bag_s: bag time at the start of playback.
        now_s: monotonic time at the start of playback.
        rate: seconds of bag time per second of monotonic time.

    >>> clock = PlaybackClock(100.0, 0.0, 2.0)
    >>> clock.due(110.0), clock.bag_time(5.0)
    (5.0, 110.0)
    """

    def __init__(self, bag_s: float, now_s: float, rate: float = 1.0) -> None:
        self._bag = bag_s
        self._now = now_s
        self._rate = rate
        self._paused_at: float | None = None

    @property
    def is_paused(self) -> bool:
        return self._paused_at is not None

    def due(self, bag_s: float) -> float:
        """Return the monotonic time at which a bag time is due. Must not be called during a pause."""
        return self._now + (bag_s - self._bag) / self._rate

    def bag_time(self, now_s: float) -> float:
        """Return the current bag time, which does not advance during a pause."""
        at = now_s if self._paused_at is None else self._paused_at
        return self._bag + (at - self._now) * self._rate

    def pause(self, now_s: float) -> None:
        if self._paused_at is None:
            self._paused_at = now_s

    def resume(self, now_s: float) -> None:
        if self._paused_at is not None:
            self._now += now_s - self._paused_at
            self._paused_at = None

    def jump(self, bag_s: float, now_s: float) -> None:
        """Continue at another bag time. A pause continues."""
        self._bag, self._now = bag_s, now_s
        if self._paused_at is not None:
            self._paused_at = now_s
