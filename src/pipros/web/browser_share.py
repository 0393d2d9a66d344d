"""Limit on concurrent service calls from the page, per browser."""

from __future__ import annotations

from contextvars import ContextVar

from pipros.node.service_connection import Slots

CALLS_OF_A_BROWSER = 4

_CALLS: ContextVar[Slots] = ContextVar("calls of this browser")


def begin_browser() -> None:
    """Set a separate limit of service calls for the current context, which serves one browser."""
    _CALLS.set(Slots(CALLS_OF_A_BROWSER))


def share_of_calls() -> Slots:
    """Return the service-call slots of the browser to which the current context belongs."""
    return _CALLS.get()
