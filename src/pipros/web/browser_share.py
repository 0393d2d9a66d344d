"""Limit of the page's service calls per browser."""

from __future__ import annotations

from contextvars import ContextVar

from pipros.node.service_connection import Slots

CALLS_OF_A_BROWSER = 4

_CALLS: ContextVar[Slots] = ContextVar("calls of this browser")


def begin_browser() -> None:
    """Give the current context, whose tasks are the requests of one browser, its own limit of calls."""
    _CALLS.set(Slots(CALLS_OF_A_BROWSER))


def share_of_calls() -> Slots:
    """Return the slots for calls of the current context's browser."""
    return _CALLS.get()
