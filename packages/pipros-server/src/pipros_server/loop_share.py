"""A client's share of the event loop, so that what it sends and requests does not keep others waiting.

Each connection of a `ServerPort` has one, whatever its protocol. A client's bytes, frames and pings count, as
do the steps of its coroutines, and what threads do for it.
"""

from __future__ import annotations

import asyncio
import math
import sys
import time
from collections.abc import Callable, Coroutine, Generator
from types import coroutine
from typing import Any, Final, ParamSpec

P = ParamSpec("P")

SHARE: Final = 0.5
"""Part of the event loop's time that a client may use.

While all clients together use more, each of the busy ones may use an equal part of it only.
"""
BURST_S: Final = 0.1
"""Time (s) that a client may use at once."""
BUSY: Final = 0.01
"""Part of the loop's time beyond which a client counts as busy."""
STEP_S: Final = 0.001
"""Time (s) after which `LoopShare.end_long_step` ends a step."""
_WINDOW_S: Final = 1.0


def switch_threads_often() -> None:
    """Let threads that compute for one client, such as those of images, keep the loop waiting less.

    Changes the whole process, so call it in commands only. The default is 5 ms for each time the loop reads.
    """
    sys.setswitchinterval(0.0005)


class RecentWork:
    """Part of the time that was spent working in about the last `_WINDOW_S`; older work counts less."""

    __slots__ = ("_updated_s", "_worked_s")

    def __init__(self) -> None:
        self._worked_s = self._updated_s = 0.0

    def add(self, worked_s: float) -> float:
        """Add work that has just been done, and return the part."""
        now_s = time.monotonic()
        self._worked_s *= math.exp((self._updated_s - now_s) / _WINDOW_S)
        self._worked_s += worked_s
        self._updated_s = now_s
        return self._worked_s / _WINDOW_S


class LoopShares:
    """What the shares of all clients of one event loop have in common.

    Attributes:
        work: the work of all clients together.
        busy: the shares of the clients that are busy, or were.
    """

    def __init__(self) -> None:
        self.work = RecentWork()
        self.busy: set[LoopShare] = set()

    def busy_now(self) -> set[LoopShare]:
        """Remove from `busy` the clients that no longer are, and return it."""
        self.busy = {each for each in self.busy if each.is_busy}
        return self.busy


class LoopShare:
    """Measures how long the coroutines of one client occupy the loop, and delays them beyond its part."""

    def __init__(self, shares: LoopShares) -> None:
        self._shares = shares
        self._due_s = 0.0
        self._work = RecentWork()
        self._turn = asyncio.Lock()
        self._step_began_s = -math.inf
        self._in_threads_s = 0.0
        self._is_open = True

    def close(self) -> None:
        """Leave this client's part to the others, though its coroutines may have more to do."""
        self._is_open = False
        self._shares.busy.discard(self)

    async def run(
        self, function: Callable[P, Coroutine[Any, None, None]], *args: P.args, **kwargs: P.kwargs
    ) -> None:
        """Call a coroutine function. It rests only where it waits anyway, and not after it was cancelled."""
        await self._steps(function(*args, **kwargs))

    @coroutine
    def _steps(self, work: Coroutine[Any, None, None]) -> Generator[Any, None, None]:
        thrown: BaseException | None = None
        while True:
            try:
                if thrown is None:
                    yield from self._rest().__await__()
            except BaseException as error:
                thrown = error
            begin_s = self._step_began_s = time.monotonic()
            try:
                waiting = work.send(None) if thrown is None else work.throw(thrown)
            except StopIteration:
                return
            finally:
                self.note(time.monotonic() - begin_s)
            thrown = None
            try:
                yield waiting
            except BaseException as error:
                thrown = error

    async def end_long_step(self) -> None:
        """End the current step if it has taken long. Call it in loops that may never have to wait."""
        if time.monotonic() - self._step_began_s > STEP_S:
            await asyncio.sleep(0)

    async def _rest(self) -> None:
        if self.pause_s() <= 0:
            return
        async with self._turn:  # so that only one of many coroutines wakes up
            while (pause_s := self.pause_s()) > 0:
                await asyncio.sleep(pause_s)

    def pause_s(self) -> float:
        """Return how long (s) the client's work must pause now; not positive if it need not."""
        own_s = self._due_s - time.monotonic()
        all_together = self._shares.work.add(0.0)
        if all_together <= SHARE:
            return own_s
        used, busy = self._work.add(0.0), self._shares.busy_now()
        part = SHARE / max(1, len(busy))
        if used <= part or busy == {self}:
            return own_s
        return max(own_s, _WINDOW_S * math.log(min(all_together / SHARE, used / part)))

    def note(self, worked_s: float) -> None:
        """Count work for the client that has just been done in the loop."""
        self._due_s = max(self._due_s, time.monotonic() - BURST_S / SHARE) + worked_s / SHARE
        self._count(worked_s)

    def note_threads(self, total_s: float) -> None:
        """Count what threads have done for the client, given as the total (s) since the beginning.

        While no other client is busy, a client may use a whole processor for it.
        """
        self._count(total_s - self._in_threads_s)
        self._in_threads_s = total_s

    def _count(self, worked_s: float) -> None:
        self._shares.work.add(worked_s)
        if self._work.add(worked_s) > BUSY and self._is_open:
            self._shares.busy.add(self)

    @property
    def is_busy(self) -> bool:
        return self._work.add(0.0) > BUSY
