"""The browser that the current context (`contextvars`) serves, and its slots for service calls."""

from __future__ import annotations

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
