"""Time as a node sees it: the wall clock, or the one that `/clock` simulates.

All waits end when the node shuts down. Source: http://wiki.ros.org/Clock
"""

from __future__ import annotations

import threading
import time
from typing import Protocol

from pipros.errors import PiprosError

NS_PER_S = 1_000_000_000


class TimeMovedBackwards(PiprosError):
    """Simulated time jumped back while somebody waited for a later one.

    Attributes:
        jump_s: seconds by which it went back, negative.
    """

    def __init__(self, jump_s: float) -> None:
        self.jump_s = jump_s
        super().__init__(f"ROS time moved backwards: {jump_s}s")


class Clock(Protocol):
    """A source of time that can be waited on."""

    @property
    def is_simulated(self) -> bool: ...

    def now_ns(self) -> int:
        """Nanoseconds since the epoch; 0 while a simulated clock has not started."""
        ...

    def sleep(self, duration_s: float) -> bool:
        """Waits; False when the node shut down meanwhile.

        Raises:
            TimeMovedBackwards: simulated time jumped back.
        """
        ...

    def close(self) -> None:
        """Ends all waits, for good."""
        ...


class WallClock:
    """The time of the machine. Waits follow the monotonic clock."""

    is_simulated = False

    def __init__(self) -> None:
        self._closed = threading.Event()

    def now_ns(self) -> int:
        return time.time_ns()

    def sleep(self, duration_s: float) -> bool:
        if duration_s <= 0:
            return not self._closed.is_set()
        return not self._closed.wait(duration_s)

    def close(self) -> None:
        self._closed.set()


class SimulatedClock:
    """The time that somebody publishes on `/clock`."""

    is_simulated = True

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._now_ns = 0
        self._jumps = 0  # how often time went back
        self._last_jump_s = 0.0
        self._is_closed = False

    def set_ns(self, now_ns: int) -> None:
        """Takes over a message of `/clock`."""
        with self._changed:
            if now_ns < self._now_ns:
                self._jumps += 1
                self._last_jump_s = (now_ns - self._now_ns) / NS_PER_S
            self._now_ns = now_ns
            self._changed.notify_all()

    def now_ns(self) -> int:
        return self._now_ns

    def sleep(self, duration_s: float) -> bool:
        """Waits for simulated time; one that has not started is waited for first."""
        with self._changed:
            self._changed.wait_for(lambda: self._now_ns or self._is_closed)
            end_ns, jumps = self._now_ns + int(duration_s * NS_PER_S), self._jumps
            self._changed.wait_for(lambda: self._now_ns >= end_ns or self._is_closed or self._jumps != jumps)
            if self._jumps != jumps:
                raise TimeMovedBackwards(self._last_jump_s)
            return not self._is_closed

    def close(self) -> None:
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
