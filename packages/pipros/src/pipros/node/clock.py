"""A node's clock: the wall clock, or the simulated time of `/clock`.

All waits end when the node shuts down.

Source: http://wiki.ros.org/Clock
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Protocol

from pipros.basics import one_thread
from pipros.basics.errors import PiprosError
from pipros.basics.interruptible_wait import OnceEvent, wait_in_slices
from pipros.msg.time import NS_PER_S, Time
from pipros.node.timings import NODE_TIMINGS


class TimeMovedBackwards(PiprosError):
    """Simulated time jumped back during a wait.

    Attributes:
        jump_s: the jump in seconds; negative.
    """

    def __init__(self, jump_s: float) -> None:
        self.jump_s = jump_s
        super().__init__(f"ROS time moved backwards: {jump_s}s")


class Clock(Protocol):
    """A source of time, with an interruptible sleep."""

    @property
    def is_simulated(self) -> bool: ...

    def now_ns(self) -> int:
        """Return the time in nanoseconds since the epoch, or 0 while a simulated clock has not started."""
        ...

    def sleep(self, duration_s: float) -> bool:
        """Sleep for `duration_s`. Return False if the node was shut down in the meantime.

        Raises:
            TimeMovedBackwards: simulated time jumped back.
        """
        ...

    def interrupt(self, exempt: int | None = None) -> None:
        """End all current and future waits, except in the thread with the identifier `exempt`."""
        ...


def stamp(clock: Clock) -> Time:
    """Return the current time as a timestamp for messages."""
    return Time(*divmod(clock.now_ns(), NS_PER_S))


class WallClock:
    """The system clock. Waits use the monotonic clock."""

    is_simulated = False

    def __init__(self) -> None:
        self._interrupted = OnceEvent()
        self._exempt: int | None = None

    def now_ns(self) -> int:
        return time.time_ns()

    def sleep(self, duration_s: float) -> bool:
        if self._exempt == threading.get_ident():
            time.sleep(max(duration_s, 0))
            return True
        if not one_thread.has_threads() and self._interrupted.is_set():
            time.sleep(0)  # takes a turn, also in a loop that ignores the end
        if duration_s <= 0 and one_thread.has_threads():
            return not self._interrupted.is_set()
        return not self._interrupted.wait(duration_s)

    def interrupt(self, exempt: int | None = None) -> None:
        self._exempt = exempt
        self._interrupted.set()


class TimeSource(Protocol):
    """What receives the simulated time."""

    @property
    def connection_count(self) -> int: ...


class SimulatedClock:
    """A clock that shows the time published on `/clock`.

    Attributes:
        source: what receives the time, if it can tell whether somebody publishes it.
    """

    is_simulated = True
    source: TimeSource | None = None

    def __init__(
        self,
        on_silence: Callable[[], object] = lambda: None,
        silence_s: float = NODE_TIMINGS.clock_silence_s,
    ) -> None:
        """Store the arguments.

        `on_silence` is called if a thread has waited for `silence_s` and no time has been published yet
        (ros_comm#2111).
        """
        self._silence_s = silence_s
        self._on_silence = on_silence
        self.changed = threading.Condition()
        self._now_ns = 0
        self._jumps = 0  # number of backward jumps of the simulated time
        self._sleepers = 0
        self._last_jump_s = 0.0
        self._is_interrupted = False
        self._exempt: int | None = None

    def set_ns(self, now_ns: int) -> None:
        """Set the time from a `/clock` message."""
        with self.changed:
            if now_ns < self._now_ns:
                self._jumps += 1
                self._last_jump_s = (now_ns - self._now_ns) / NS_PER_S
            self._now_ns = now_ns
            self.changed.notify_all()

    def now_ns(self) -> int:
        return self._now_ns

    def sleep(self, duration_s: float) -> bool:
        """Wait for a duration of simulated time. If the clock has not started, wait for its start first."""
        self._wait_for_start()
        with self.changed:
            end_ns, jumps = self._now_ns + int(duration_s * NS_PER_S), self._jumps
            self._sleepers += 1
            try:
                wait_in_slices(
                    lambda limit_s: self.changed.wait_for(
                        lambda: self._now_ns >= end_ns or self._must_end() or self._jumps != jumps, limit_s
                    )
                )
            finally:
                self._sleepers -= 1
            if self._jumps != jumps:
                raise TimeMovedBackwards(self._last_jump_s)
            return not self._must_end()

    @property
    def is_driven(self) -> bool:
        """Whether somebody publishes the time, which stands otherwise."""
        return self.source is None or self.source.connection_count > 0

    @property
    def sleeper_count(self) -> int:
        """The number of threads that are sleeping on this clock."""
        return self._sleepers

    def _wait_for_start(self) -> None:
        with self.changed:
            has_started = wait_in_slices(
                lambda limit_s: self.changed.wait_for(self._has_started, limit_s), self._silence_s
            )
            if has_started:
                return
        self._on_silence()
        with self.changed:
            wait_in_slices(lambda limit_s: self.changed.wait_for(self._has_started, limit_s))

    def _has_started(self) -> bool:
        return self._now_ns > 0 or self._must_end()

    def interrupt(self, exempt: int | None = None) -> None:
        with self.changed:
            self._is_interrupted = True
            self._exempt = exempt
            self.changed.notify_all()

    def _must_end(self) -> bool:
        return self._is_interrupted and self._exempt != threading.get_ident()
