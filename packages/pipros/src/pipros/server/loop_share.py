"""A browser's share of the event loop, so that its views and actions do not keep those of others waiting."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Coroutine, Generator
from types import coroutine
from typing import Any, Final, ParamSpec

P = ParamSpec("P")

SHARE: Final = 0.5
"""Part of the event loop's time that a browser may use.

While all browsers together use more, each of the busy ones may use an equal part of it only.
"""
BURST_S: Final = 0.1
"""Time (s) that a browser may use at once."""
BUSY: Final = 0.01
"""Part of the loop's time beyond which a browser counts as busy."""
_WINDOW_S: Final = 1.0


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
    """What the shares of all browsers of one event loop have in common.

    Attributes:
        work: the work of all browsers together.
        busy: the shares of the browsers that are busy.
    """

    def __init__(self) -> None:
        self.work = RecentWork()
        self.busy: set[LoopShare] = set()


class LoopShare:
    """Measures how long the coroutines of one browser occupy the loop, and delays them beyond its part."""

    def __init__(self, shares: LoopShares) -> None:
        self._shares = shares
        self._due_s = 0.0
        self._work = RecentWork()
        self._turn = asyncio.Lock()

    def close(self) -> None:
        """Leave this browser's part to the others. Its coroutines must have ended."""
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
            begin_s = time.monotonic()
            try:
                waiting = work.send(None) if thrown is None else work.throw(thrown)
            except StopIteration:
                return
            finally:
                self._note(time.monotonic() - begin_s)
            thrown = None
            try:
                yield waiting
            except BaseException as error:
                thrown = error

    async def _rest(self) -> None:
        if self._pause_s() <= 0:
            return
        async with self._turn:  # so that only one of many coroutines wakes up
            while (pause_s := self._pause_s()) > 0:
                await asyncio.sleep(pause_s)

    def _pause_s(self) -> float:
        own_s = self._due_s - time.monotonic()
        all_together = self._shares.work.add(0.0)
        if all_together <= SHARE:
            return own_s
        used, part = self._work.add(0.0), SHARE / max(1, len(self._shares.busy))
        if used <= part:
            return own_s
        return max(own_s, _WINDOW_S * math.log(min(all_together / SHARE, used / part)))

    def _note(self, worked_s: float) -> None:
        self._due_s = max(self._due_s, time.monotonic() - BURST_S / SHARE) + worked_s / SHARE
        self._shares.work.add(worked_s)
        is_busy = self._work.add(worked_s) > BUSY
        (self._shares.busy.add if is_busy else self._shares.busy.discard)(self)
