"""A browser's share of the event loop, so that its views and actions do not keep those of others waiting."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Generator
from types import coroutine
from typing import Any, Final, ParamSpec

P = ParamSpec("P")

SHARE: Final = 0.5
"""Part of the event loop's time that a browser may use."""
BURST_S: Final = 0.1
"""Time (s) that a browser may use at once."""


class LoopShare:
    """Measures how long the coroutines of one browser occupy the loop, and delays them beyond `SHARE`."""

    def __init__(self) -> None:
        self._due_s = 0.0

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
        while (pause_s := self._due_s - time.monotonic()) > 0:
            await asyncio.sleep(pause_s)

    def _note(self, worked_s: float) -> None:
        self._due_s = max(self._due_s, time.monotonic() - BURST_S / SHARE) + worked_s / SHARE
