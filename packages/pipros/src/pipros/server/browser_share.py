"""The browser that the current context (`contextvars`) serves, and its share of what all browsers may use."""

from __future__ import annotations

from collections.abc import Collection
from contextvars import ContextVar

from pipros.node.service_connection import Slots

CALLS_OF_A_BROWSER = 4


class Browser:
    """One connected browser. Compared by identity, so that other modules can keep state for it.

    Attributes:
        calls: its slots for service calls.
    """

    __slots__ = ("calls",)

    def __init__(self) -> None:
        self.calls = Slots(CALLS_OF_A_BROWSER)


_BROWSER: ContextVar[Browser] = ContextVar("browser")


def set_current_browser() -> None:
    """Make the current context serve a new browser."""
    _BROWSER.set(Browser())


def current_browser() -> Browser:
    """Return the browser that the current context serves."""
    return _BROWSER.get()


def browser_or_none() -> Browser | None:
    """Return the browser that the current context serves, or None if it serves none."""
    return _BROWSER.get(None)


def has_share(holders: Collection[Browser | None], limit: int) -> bool:
    """Return whether the current browser may hold one more of `limit` things: half of what others leave.

    Any number of greedy browsers thus leave something for the next one.

    Args:
        holders: the browser of each thing that is held now.
    """
    browser = browser_or_none()
    own = sum(each is browser for each in holders)
    return 2 * own < limit - (len(holders) - own)
