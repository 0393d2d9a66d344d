"""Callbacks of many peers in one event loop, of which a millisecond runs at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from pipros.basics.turns import Turns

TURN_S: Final = 0.001
"""How long callbacks, or the calls of a multicall, run before the loop serves others."""


class LoopTurns:
    """Runs what peers make a loop do beyond their first request, so that others wait for little of it."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._turns: Turns[str, Callable[[], object]] = Turns()
        self._is_scheduled = False

    def put(self, peer: str, callback: Callable[[], object]) -> None:
        """Call a function when it is the turn of the peer. Must be called in the loop."""
        self._turns.put(peer, callback)
        self._schedule()

    def _schedule(self) -> None:
        if len(self._turns) and not self._is_scheduled:
            self._is_scheduled = True
            self._loop.call_soon(self._run)

    def _run(self) -> None:
        ends_s = self._loop.time() + TURN_S
        try:
            while len(self._turns) and self._loop.time() < ends_s:
                self._turns.pop()[1]()  # which may put another
        finally:
            self._is_scheduled = False
            self._schedule()
