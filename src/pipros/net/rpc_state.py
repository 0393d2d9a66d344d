"""The states of a connection of an `RpcServer`, and what moves it from one to the next. Pure.

Theory of operation. In `READING` the connection waits for bytes, or is in the middle of a turn. Three states
are busy: requests that arrive then wait in the reader, and nothing more is read from the socket.

    QUEUED     a later turn of the event loop sends the next slice, or answers the next request
    ANSWERING  a task works on an answer: the method waits, or a thread reads or writes a large value
    STALLED    the peer does not read, and the transport has asked for a pause in writing

Writing happens in turns and at the end of a task only, so a connection that is QUEUED or ANSWERING cannot
become STALLED. Three states are final, in the order in which they follow each other:

    DRAINING   a request was refused: what the peer still sends is discarded, so that it can read why
    CLOSING    everything is written; the transport closes when it is sent
    CLOSED     aborted or lost

An event that the table does not list for a state has no effect in it.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class State(Enum):
    """Where a connection stands; see the module."""

    READING = auto()
    QUEUED = auto()
    ANSWERING = auto()
    STALLED = auto()
    DRAINING = auto()
    CLOSING = auto()
    CLOSED = auto()


class Event(Enum):
    """What happens to a connection."""

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
    """What a connection does next when nothing is pending."""

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
        Event.REQUEST_REFUSED: State.DRAINING,  # the answer to the refused request filled the transport
        Event.CLOSED_GRACEFULLY: State.CLOSING,
        Event.ABORTED: State.CLOSED,
    },
    State.DRAINING: {Event.CLOSED_GRACEFULLY: State.CLOSING, Event.ABORTED: State.CLOSED},
    State.CLOSING: {Event.ABORTED: State.CLOSED},
    State.CLOSED: {},
}


def after(state: State, event: Event) -> State:
    """The state that an event leads to.

    >>> after(State.READING, Event.TASK_BEGAN), after(State.CLOSED, Event.TASK_DONE)
    (<State.ANSWERING: 3>, <State.CLOSED: 7>)
    """
    return _TRANSITIONS[state].get(event, state)


def next_step(*, has_unsent: bool, is_last_answer: bool, has_input: bool, has_peer_ended: bool) -> Step:
    """What comes next for a connection that is not busy.

    Args:
        has_unsent: a part of the last answer has not been given to the transport.
        is_last_answer: the last answer ends the connection.
        has_input: bytes wait in the reader that have not been tried as a request.
        has_peer_ended: the peer sends nothing more.
    """
    if has_unsent:
        return Step.QUEUE_TURN
    if is_last_answer:
        return Step.CLOSE
    if has_input:
        return Step.QUEUE_TURN
    return Step.CLOSE if has_peer_ended else Step.READ
