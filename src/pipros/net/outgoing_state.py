"""The states of an `OutgoingLink`, and their transitions. Pure.

    IDLE        no message waits: the publishing thread writes to the socket
    BEHIND      messages wait for the publishing thread, which may wait for the subscriber
    QUEUED      messages wait for the event loop
    STALLED     as QUEUED, after a publisher without a queue waited in vain: it does not wait again
    RECOVERING  a stalled link without waiting messages, whose subscriber has yet to read what was written
    CLOSED      the end

An event that the table does not list for a state does nothing.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class State(Enum):
    """The state of a link; see the module."""

    IDLE = auto()
    BEHIND = auto()
    QUEUED = auto()
    STALLED = auto()
    RECOVERING = auto()
    CLOSED = auto()


class Event(Enum):
    """An event of a link."""

    SOCKET_FULL = auto()
    """The socket did not accept a whole message."""
    EMPTIED = auto()
    """The last waiting message was written."""
    LEFT_TO_LOOP = auto()
    """The publishing thread does not wait, or has waited as long as it may with a queue."""
    WAITED_IN_VAIN = auto()
    """The publishing thread has waited as long as it may without a queue."""
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
"""Messages wait. (These are tuples, because members of an enum are slow to hash.)"""

WRITTEN_BY_LOOP: Final = (State.QUEUED, State.STALLED)

NOT_WAITED_FOR: Final = (State.STALLED, State.RECOVERING)


def after(state: State, event: Event) -> State:
    """Return the state after an event.

    >>> after(State.IDLE, Event.SOCKET_FULL), after(State.CLOSED, Event.EMPTIED)
    (<State.BEHIND: 2>, <State.CLOSED: 6>)
    """
    return _TRANSITIONS[state].get(event, state)
