"""Fixed-rate loops and timers that use a node's clock."""

from __future__ import annotations

import logging
import os
import threading
import traceback
from collections.abc import Callable
from typing import NamedTuple

from pipros.basics import one_thread
from pipros.basics.errors import Interrupted
from pipros.msg.time import NS_PER_S
from pipros.node.clock import Clock, TimeMovedBackwards

LOOK_S = 0.02
"""Without threads, a timer looks at simulated time this often."""


class Rate:
    """Keeps a loop at a fixed rate: `sleep` waits for the rest of the current cycle.

    A loop that is several cycles late does not catch up.
    """

    def __init__(self, clock: Clock, period_ns: int, *, reset: bool = False) -> None:
        """Start the first cycle.

        If `reset` is true, `sleep` restarts the cycle instead of raising when simulated time moves backwards.
        """
        self.period_ns = period_ns
        self.last_ns = clock.now_ns()
        self._clock = clock
        self._reset = reset

    def remaining_ns(self, now_ns: int | None = None) -> int:
        """Return the time until the current cycle ends, in nanoseconds; negative if the cycle has ended."""
        now_ns = self._clock.now_ns() if now_ns is None else now_ns
        if self.last_ns > now_ns:  # simulated time has moved backwards: the cycle starts now
            self.last_ns = now_ns
        return self.last_ns + self.period_ns - now_ns

    def sleep(self) -> bool:
        """Wait for the end of the cycle; return False if the node shut down in the meantime.

        Raises:
            TimeMovedBackwards: simulated time moved backwards, and `reset` is False.
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


class Tick(NamedTuple):
    """The argument of a timer's callback.

    Attributes:
        last_expected_ns: time when the previous callback was due; None for the first call.
        last_real_ns: time when the previous callback was called; None for the first call.
        current_expected_ns: time when this callback was due.
        current_real_ns: time when this callback was called.
        last_duration_s: duration of the previous callback; None for the first call.
    """

    last_expected_ns: int | None
    last_real_ns: int | None
    current_expected_ns: int
    current_real_ns: int
    last_duration_s: float | None


def surviving(
    do: Callable[[], object], log: logging.Logger, failed: Callable[[], object] | None = None
) -> Callable[[], None]:
    """Return a function that calls `do`, and that does not raise if `do` raises an `Exception`.

    In this case, it calls `failed` and logs the error, once for each type of error and line of code.
    """
    logged: set[tuple[str, str, int | None]] = set()

    def call() -> None:
        try:
            do()
        except Exception as error:
            if failed is not None:
                failed()
            place = traceback.extract_tb(error.__traceback__)[-1]
            kind = type(error).__name__, os.path.basename(place.filename), place.lineno
            if kind not in logged:
                logged.add(kind)
                log.error("a cycle failed (%s: %s, %s:%s); the next ones go on", kind[0], error, *kind[1:])

    return call


class Timer(threading.Thread):
    """A daemon thread that calls a function periodically until the timer or the node is shut down.

    The constructor starts the thread. `callback` receives a `Tick`. With `oneshot`, the thread exits after
    one call. For `reset`, see `Rate`.
    """

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
        self._rate: Rate
        self._last: tuple[int, int, float] | tuple[None, None, None] = None, None, None
        self._expected_ns = 0
        self.start()

    def start(self) -> None:
        """Start the thread. Without threads, the only thread calls the function where it waits."""
        if one_thread.has_threads():
            super().start()
        else:
            one_thread.later(self.run)

    def shutdown(self) -> None:
        """Stop calling the function. A running call is not interrupted."""
        self._is_shutdown = True

    def run(self) -> None:
        """Run the timer. Called only by the thread itself."""
        self._rate = Rate(self._clock, self._period_ns, reset=self._reset)
        self._expected_ns = self._rate.last_ns + self._period_ns
        if one_thread.has_threads():
            self._run_until_shutdown()
        else:
            one_thread.start_work(self._run_until_shutdown, self._take_turn, name=self.name)

    def _run_until_shutdown(self) -> None:
        while self._rate.sleep() and not self._is_shutdown and self._call():
            pass

    def _take_turn(self) -> float | None:
        """Call the function if it is due. Return the time in seconds until the next look, or None to end."""
        left_s = self._rate.remaining_ns() / NS_PER_S
        if left_s > 0 or self._clock.now_ns() == 0:  # zero: simulated time has not started
            return min(left_s, LOOK_S) if self._clock.is_simulated else left_s
        return 0.0 if self._rate.sleep() and not self._is_shutdown and self._call() else None

    def _call(self) -> bool:
        """Call the function. Return False if it was the last call."""
        real_ns = self._clock.now_ns()
        last_expected_ns, last_real_ns, last_duration_s = self._last
        try:
            self._callback(Tick(last_expected_ns, last_real_ns, self._expected_ns, real_ns, last_duration_s))
        except Interrupted:  # the node ends while the callback waits
            return False
        self._last = self._expected_ns, real_ns, (self._clock.now_ns() - real_ns) / NS_PER_S
        self._expected_ns += self._period_ns
        return not self._oneshot
