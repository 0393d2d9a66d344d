"""The browser that the current context (`contextvars`) serves, and its share of what all browsers may use."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar

from pipros.basics.budget import Slots

CALLS_OF_A_BROWSER = 4


class SpentTime:
    """Processor time spent in the current second."""

    __slots__ = ("_second", "_spent_s")

    def __init__(self) -> None:
        self._second, self._spent_s = 0, 0.0

    def add(self, spent_s: float) -> float:
        """Add time (s), and return the sum."""
        if (second := int(time.monotonic())) != self._second:
            self._second, self._spent_s = second, 0.0
        self._spent_s += spent_s
        return self._spent_s


Ping = Callable[[], Awaitable[Awaitable[object]]]
"""Function that sends a ping, and returns what waits for the pong."""


class Browser:
    """One connected browser. Compared by identity, so that other modules can keep state for it.

    Attributes:
        calls: its slots for service calls.
        plotting: the time spent on the messages that it plots.
    """

    __slots__ = ("__weakref__", "_ping", "calls", "plotting")

    def __init__(self, ping: Ping | None = None) -> None:
        """Create the state of a browser. `ping` sends it a ping; None if it has no connection of its own."""
        self.calls = Slots(CALLS_OF_A_BROWSER)
        self.plotting = SpentTime()
        self._ping = ping

    async def until_silent(self, limit_s: float) -> None:
        """Return once the browser has not answered a ping for `limit_s`: it is suspended, or its link lost.

        The page may be hidden. TCP reports neither.
        """
        while self._ping is not None:
            begin_s = time.monotonic()
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._answer(self._ping), limit_s)
                await asyncio.sleep(limit_s / 4)
                continue
            if time.monotonic() - begin_s < 2 * limit_s:  # otherwise, the server was suspended itself
                return
        await asyncio.Event().wait()

    @staticmethod
    async def _answer(ping: Ping) -> None:
        await (await ping())


_BROWSER: ContextVar[Browser] = ContextVar("browser")


def set_current_browser(ping: Ping | None = None) -> None:
    """Make the current context serve a new browser; see `Browser`."""
    _BROWSER.set(Browser(ping))


@contextmanager
def serving(browser: Browser) -> Iterator[None]:
    """Context manager in which the current context serves a browser, or another client with a share."""
    before = _BROWSER.set(browser)
    try:
        yield
    finally:
        _BROWSER.reset(before)


def current_browser() -> Browser:
    """Return the browser that the current context serves."""
    return _BROWSER.get()


def browser_or_none() -> Browser | None:
    """Return the browser that the current context serves, or None if it serves none."""
    return _BROWSER.get(None)


def has_share(browser: Browser | None, holders: Collection[Browser | None], limit: int) -> bool:
    """Return whether a browser may hold one more of `limit` things: half of what others leave.

    Any number of greedy browsers thus leave something for the next one. None, not a browser, may hold
    all that is left.

    Args:
        holders: the browser of each thing that is held now.
    """
    own = 0 if browser is None else sum(each is browser for each in holders)
    return 2 * own < limit - (len(holders) - own)
