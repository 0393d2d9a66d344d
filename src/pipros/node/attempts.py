"""How many connections a node tries to make at a time."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Final, TypeVar

T = TypeVar("T")

SLOW_S: Final = 1.0
"""An attempt that takes longer makes room for others: most hosts that take so long do not answer at all."""

SLOW_FACTOR: Final = 10
"""For each attempt that is allowed, so many slow ones may go on at the same time."""


class Attempts:
    """Bounds the attempts of a node to connect to publishers. For the event loop only.

    First attempts come before repeated ones, so that a peer that lists publishers which do not exist does not
    keep others waiting for long.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._quick = 0
        self._slow = 0
        self._first: deque[asyncio.Future[None]] = deque()
        self._again: deque[asyncio.Future[None]] = deque()

    @property
    def under_way(self) -> int:
        return self._quick + self._slow

    async def make(self, attempt: Callable[[], Awaitable[T]], *, is_first: bool) -> T:
        """Makes an attempt when it is its turn; returns and raises what it does."""
        loop = asyncio.get_running_loop()
        if self._quick < self._limit:
            self._quick += 1
        else:
            await self._wait(self._first if is_first else self._again, loop.create_future())
        is_slow = False

        def make_room() -> None:
            nonlocal is_slow
            if self._slow < self._limit * SLOW_FACTOR:
                is_slow = True
                self._slow += 1
                self._pass_on()

        timer = loop.call_later(SLOW_S, make_room)
        try:
            return await attempt()
        finally:
            timer.cancel()
            if is_slow:
                self._slow -= 1
            else:
                self._pass_on()

    async def _wait(self, queue: deque[asyncio.Future[None]], turn: asyncio.Future[None]) -> None:
        queue.append(turn)
        try:
            await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():  # the turn was granted, but is not needed any more
                self._pass_on()
            raise

    def _pass_on(self) -> None:
        """Passes the turn of an attempt to the next, if there is one."""
        for queue in (self._first, self._again):
            while queue:
                turn = queue.popleft()
                if not turn.done():
                    turn.set_result(None)
                    return
        self._quick -= 1
