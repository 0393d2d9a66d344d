"""Loops at a fixed rate, and callbacks by a timer, on a node's clock."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from pipros.msg.time import NS_PER_S
from pipros.node.clock import Clock, TimeMovedBackwards


class Rate:
    """Keeps a loop at a rate: `sleep` waits for what is left of the current cycle.

    A loop that is late does not hurry to make up for it once it is two cycles behind.
    """

    def __init__(self, clock: Clock, period_ns: int, *, reset: bool = False) -> None:
        """`reset` starts over when simulated time goes back, instead of raising."""
        self.period_ns = period_ns
        self.last_ns = clock.now_ns()
        self._clock = clock
        self._reset = reset

    def remaining_ns(self) -> int:
        """Nanoseconds until the current cycle ends; negative when it is over."""
        now_ns = self._clock.now_ns()
        if self.last_ns > now_ns:  # simulated time has gone back: the cycle begins now
            self.last_ns = now_ns
        return self.last_ns + self.period_ns - now_ns

    def sleep(self) -> bool:
        """Waits for the end of the cycle; False when the node shut down meanwhile.

        Raises:
            TimeMovedBackwards: simulated time went back, and `reset` is off.
        """
        now_ns = self._clock.now_ns()
        try:
            goes_on = self._clock.sleep(self.remaining_ns() / NS_PER_S)
        except TimeMovedBackwards:
            if not self._reset:
                raise
            self.last_ns = self._clock.now_ns()
            return True
        self.last_ns += self.period_ns
        if now_ns - self.last_ns > 2 * self.period_ns:
            self.last_ns = now_ns
        return goes_on


@dataclass(frozen=True, slots=True)
class Tick:
    """What a timer passes to its callback; all times in nanoseconds.

    Attributes:
        last_expected_ns: when the callback before this one should have been called; None at first.
        last_real_ns: when it really was.
        current_expected_ns: when this one should have been called.
        current_real_ns: when it really is.
        last_duration_s: how long the callback before took.
    """

    last_expected_ns: int | None
    last_real_ns: int | None
    current_expected_ns: int
    current_real_ns: int
    last_duration_s: float | None


class Timer(threading.Thread):
    """A daemon thread, running already, that calls a function until it or the node is shut down."""

    def __init__(
        self,
        clock: Clock,
        period_ns: int,
        callback: Callable[[Tick], object],
        *,
        oneshot: bool = False,
        reset: bool = False,
        name: str = "timer",
    ) -> None:
        super().__init__(name=name, daemon=True)
        self._clock = clock
        self._period_ns = period_ns
        self._callback = callback
        self._oneshot = oneshot
        self._reset = reset
        self._is_shutdown = False
        self.start()

    def shutdown(self) -> None:
        """No more calls; one under way ends by itself."""
        self._is_shutdown = True

    def run(self) -> None:
        """What the thread does; not for callers."""
        rate = Rate(self._clock, self._period_ns, reset=self._reset)
        expected_ns = rate.last_ns + self._period_ns
        last_expected_ns = last_real_ns = last_duration_s = None
        while rate.sleep() and not self._is_shutdown:
            real_ns = self._clock.now_ns()
            self._callback(Tick(last_expected_ns, last_real_ns, expected_ns, real_ns, last_duration_s))
            if self._oneshot:
                return
            last_duration_s = (self._clock.now_ns() - real_ns) / NS_PER_S
            last_expected_ns, last_real_ns = expected_ns, real_ns
            expected_ns += self._period_ns
