"""State of one browser: its slots for service calls, and the bag that it has opened."""

from __future__ import annotations

from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

from pipros.node.service_connection import Slots

CALLS_OF_A_BROWSER = 4

_CALLS: ContextVar[Slots] = ContextVar("calls of this browser")


@dataclass(slots=True)
class BrowserBag:
    """The bag that a browser shows.

    Attributes:
        playback: a `BagPlayback`; None if the browser shows the running system.
        views: the playback's current system, and its views and actions by name.
    """

    playback: Any = None  # importing the type would create an import cycle
    views: Any = None


_BAG: ContextVar[BrowserBag] = ContextVar("bag of this browser")


def begin_browser() -> None:
    """Create the state of a new browser in the current context."""
    _CALLS.set(Slots(CALLS_OF_A_BROWSER))
    _BAG.set(BrowserBag())


def share_of_calls() -> Slots:
    """Return the service-call slots of the browser to which the current context belongs."""
    return _CALLS.get()


def bag_of_browser() -> BrowserBag:
    """Return the bag of the browser to which the current context belongs."""
    return _BAG.get()
