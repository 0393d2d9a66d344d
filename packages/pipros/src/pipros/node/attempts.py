"""Limit the number of connections that a node tries to open at the same time."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Final, TypeVar

from pipros.node.timings import NODE_TIMINGS

T = TypeVar("T")

SLOW_FACTOR: Final = 10
"""Maximum number of slow attempts in progress, as a multiple of the limit."""


class Attempts:
    """Limits a node's concurrent attempts to connect to publishers. For the event loop only.

    First attempts take precedence over repeated ones, so that nonexistent publishers in the master's list do
    not delay others for long.
    """

    def __init__(
        self, limit: int, *, slow_s: float = NODE_TIMINGS.slow_attempt_s, slow_factor: int = SLOW_FACTOR
    ) -> None:
        """Allow `limit` attempts at a time.

        An attempt that takes longer than `slow_s` no longer counts towards this limit. At most `slow_factor`
        times `limit` attempts are exempted in this way at a time.
        """
        self._limit = limit
        self._slow_s = slow_s
        self._slow_limit = limit * slow_factor
        self._quick = 0
        self._slow = 0
        self._first: deque[asyncio.Future[None]] = deque()
        self._again: deque[asyncio.Future[None]] = deque()

    @property
    def under_way(self) -> int:
        return self._quick + self._slow

    async def make(self, attempt: Callable[[], Awaitable[T]], *, is_first: bool) -> T:
        """Wait for a free slot, then run `attempt`. Return its result, or raise its exception."""
        loop = asyncio.get_running_loop()
        if self._quick < self._limit:
            self._quick += 1
        else:
            await self._wait(self._first if is_first else self._again, loop.create_future())
        is_slow = False

        def free_slot() -> None:
            nonlocal is_slow
            if self._slow < self._slow_limit:
                is_slow = True
                self._slow += 1
                self._pass_on()

        timer = loop.call_later(self._slow_s, free_slot)
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
            if turn.done() and not turn.cancelled():  # cancelled after the slot was granted
                self._pass_on()
            raise

    def _pass_on(self) -> None:
        """Pass the slot to the next attempt, if any."""
        for queue in (self._first, self._again):
            while queue:
                turn = queue.popleft()
                if not turn.done():
                    turn.set_result(None)
                    return
        self._quick -= 1
