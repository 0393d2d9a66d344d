"""The states of an `RpcServer` connection, and their transitions.

Theory of operation. In `READING`, the connection waits for bytes or handles received bytes. Three states are
busy: further requests wait in the reader, and the socket is not read.

    QUEUED     a later turn of the event loop will send the next slice, or handle the next request
    ANSWERING  a task computes the response: the method waits, or a thread reads or writes a large value
    STALLED    the peer does not read, and the transport has paused writing

Data is written only in turns and at the end of a task, so a connection that is QUEUED or ANSWERING cannot
become STALLED. Three states are final, in this order:

    DRAINING   a request was refused: further bytes are discarded until the peer has read the response
    CLOSING    everything has been written; the transport closes once the data has been sent
    CLOSED     aborted or lost

An event that is not in the table for a state has no effect.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class State(Enum):
    """The state of a connection; see the module docstring."""

    READING = auto()
    QUEUED = auto()
    ANSWERING = auto()
    STALLED = auto()
    DRAINING = auto()
    CLOSING = auto()
    CLOSED = auto()


class Event(Enum):
    """An event on a connection; see the module docstring."""

    TURN_QUEUED = auto()
    TURN_BEGAN = auto()
    TASK_BEGAN = auto()
    TASK_DONE = auto()
    WRITING_PAUSED = auto()
    WRITING_RESUMED = auto()
    REQUEST_REFUSED = auto()
    CLOSED_GRACEFULLY = auto()
    ABORTED = auto()


class Step(Enum):
    """The next step of a connection when nothing is pending."""

    QUEUE_TURN = auto()
    CLOSE = auto()
    READ = auto()


BUSY: Final = frozenset({State.QUEUED, State.ANSWERING, State.STALLED})
FINAL: Final = frozenset({State.DRAINING, State.CLOSING, State.CLOSED})

_TRANSITIONS: Final[dict[State, dict[Event, State]]] = {
    State.READING: {
        Event.TURN_QUEUED: State.QUEUED,
        Event.TASK_BEGAN: State.ANSWERING,
        Event.WRITING_PAUSED: State.STALLED,
        Event.REQUEST_REFUSED: State.DRAINING,
        Event.CLOSED_GRACEFULLY: State.CLOSING,
        Event.ABORTED: State.CLOSED,
    },
    State.QUEUED: {Event.TURN_BEGAN: State.READING, Event.ABORTED: State.CLOSED},
    State.ANSWERING: {Event.TASK_DONE: State.READING, Event.ABORTED: State.CLOSED},
    State.STALLED: {
        Event.WRITING_RESUMED: State.READING,
        Event.REQUEST_REFUSED: State.DRAINING,  # the response to the refused request filled the transport
        Event.CLOSED_GRACEFULLY: State.CLOSING,
        Event.ABORTED: State.CLOSED,
    },
    State.DRAINING: {Event.CLOSED_GRACEFULLY: State.CLOSING, Event.ABORTED: State.CLOSED},
    State.CLOSING: {Event.ABORTED: State.CLOSED},
    State.CLOSED: {},
}


def after(state: State, event: Event) -> State:
    """Return the state after an event.

    >>> after(State.READING, Event.TASK_BEGAN), after(State.CLOSED, Event.TASK_DONE)
    (<State.ANSWERING: 3>, <State.CLOSED: 7>)
    """
    return _TRANSITIONS[state].get(event, state)


def next_step(*, has_unsent: bool, is_last_answer: bool, has_input: bool, has_peer_ended: bool) -> Step:
    """Return the next step of a connection that is not busy.

    Args:
        has_unsent: whether part of the last response has not been written to the transport.
        is_last_answer: whether the connection closes after the last response.
        has_input: whether the reader has bytes that have not been parsed.
        has_peer_ended: whether the peer has closed its half of the connection.
    """
    if has_unsent:
        return Step.QUEUE_TURN
    if is_last_answer:
        return Step.CLOSE
    if has_input:
        return Step.QUEUE_TURN
    return Step.CLOSE if has_peer_ended else Step.READ
