"""Let threads wait for transforms, with a timeout on a clock that the caller passes."""

from __future__ import annotations

from collections.abc import Callable
from threading import Condition
from typing import Protocol

from pipros.msg.time import NS_PER_S

Answer = tuple[int, str]
"""Whether a transform is available (1 or 0), and the reason if it is not."""

_SLICE_S = 0.1
"""Maximum interval between checks for Ctrl-C, shutdown and simulated time while waiting."""

_JUMP_NS = 3 * NS_PER_S
"""A wait ends if the clock jumps back to more than this before its start: a bag was probably restarted."""


class WaitingClock(Protocol):
    """The clock of a node."""

    @property
    def is_simulated(self) -> bool: ...

    def now_ns(self) -> int: ...


class TransformWaiter:
    """Lets threads wait for transforms. Each new transform wakes them.

    Attributes:
        waiting: the number of waiting threads.
    """

    def __init__(self) -> None:
        self._changed = Condition()
        self.waiting = 0

    def notify(self) -> None:
        """Wake the waiting threads. The caller must not hold a lock that `ask` needs."""
        with self._changed:
            self._changed.notify_all()

    def wait(
        self,
        ask: Callable[[], Answer],
        timeout: int,
        clock: Callable[[], WaitingClock],
        check: Callable[[], object],
    ) -> Answer:
        """Call `ask` after each new transform, and at least every 0.1 s, until it succeeds or time runs out.

        Return the last result of `ask`. `timeout` is in nanoseconds on `clock()`. If this clock jumps back to
        more than 3 s before the start of the wait, the wait times out. `check` is called before each pause;
        the wait ends if it returns True or raises an exception.
        """
        end = clock().now_ns() + timeout
        with self._changed:
            self.waiting += 1
            try:
                while not (answer := ask())[0]:
                    left = end - clock().now_ns()
                    if not 0 < left <= timeout + _JUMP_NS:
                        break
                    if check():
                        break
                    self._changed.wait(_SLICE_S if clock().is_simulated else min(left / NS_PER_S, _SLICE_S))
            finally:
                self.waiting -= 1
        return answer
