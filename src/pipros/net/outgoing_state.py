"""The states of an `OutgoingLink`, and their transitions.

    IDLE        no messages are queued; the publishing thread writes to the socket
    BEHIND      messages are queued for the publishing thread, which may wait for the subscriber
    QUEUED      messages are queued for the event loop
    STALLED     like QUEUED, but a publisher without a queue has waited in vain, and does not wait again
    RECOVERING  a stalled link with no queued messages, whose subscriber has yet to read the written data
    CLOSED      the link has been closed

An event that is not in the table for a state has no effect.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class State(Enum):
    """The state of a link; see the module docstring."""

    IDLE = auto()
    BEHIND = auto()
    QUEUED = auto()
    STALLED = auto()
    RECOVERING = auto()
    CLOSED = auto()


class Event(Enum):
    """An event on a link."""

    SOCKET_FULL = auto()
    """The socket did not accept a whole message."""
    EMPTIED = auto()
    """The last queued message was written."""
    LEFT_TO_LOOP = auto()
    """The publishing thread does not wait, or has waited as long as is allowed for a link with a queue."""
    WAITED_IN_VAIN = auto()
    """The publishing thread has waited as long as is allowed for a link without a queue."""
    CAUGHT_UP = auto()
    """The subscriber has read nearly everything that was written."""
    CLOSED = auto()


_TRANSITIONS: Final[dict[State, dict[Event, State]]] = {
    State.IDLE: {Event.SOCKET_FULL: State.BEHIND, Event.CLOSED: State.CLOSED},
    State.BEHIND: {
        Event.EMPTIED: State.IDLE,
        Event.LEFT_TO_LOOP: State.QUEUED,
        Event.WAITED_IN_VAIN: State.STALLED,
        Event.CLOSED: State.CLOSED,
    },
    State.QUEUED: {
        Event.EMPTIED: State.IDLE,
        Event.WAITED_IN_VAIN: State.STALLED,
        Event.CLOSED: State.CLOSED,
    },
    State.STALLED: {Event.EMPTIED: State.RECOVERING, Event.CLOSED: State.CLOSED},
    State.RECOVERING: {
        Event.SOCKET_FULL: State.STALLED,
        Event.CAUGHT_UP: State.IDLE,
        Event.CLOSED: State.CLOSED,
    },
    State.CLOSED: {},
}

WAITING: Final = (State.BEHIND, State.QUEUED, State.STALLED)
"""States in which messages are queued. (These are tuples, because enum members are slow to hash.)"""

WRITTEN_BY_LOOP: Final = (State.QUEUED, State.STALLED)

NOT_WAITED_FOR: Final = (State.STALLED, State.RECOVERING)


def after(state: State, event: Event) -> State:
    """Return the state after an event.

    >>> after(State.IDLE, Event.SOCKET_FULL), after(State.CLOSED, Event.EMPTIED)
    (<State.BEHIND: 2>, <State.CLOSED: 6>)
    """
    return _TRANSITIONS[state].get(event, state)
