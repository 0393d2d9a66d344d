"""The share of the page's service calls that one browser has."""

from __future__ import annotations

from contextvars import ContextVar

from pipros.node.service_connection import Slots

CALLS_OF_A_BROWSER = 4

_CALLS: ContextVar[Slots] = ContextVar("calls of this browser")


def begin_browser() -> None:
    """Give the current context, whose tasks are the requests of one browser, a share of its own."""
    _CALLS.set(Slots(CALLS_OF_A_BROWSER))


def share_of_calls() -> Slots:
    """The calls that the browser of the current context may still begin."""
    return _CALLS.get()
