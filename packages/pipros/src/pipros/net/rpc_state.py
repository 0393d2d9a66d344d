"""The states of an `RpcServer` connection, and their transitions.

Theory of operation. In `READING`, the connection waits for bytes or handles received bytes. Three states are
busy: further requests wait in the reader, and the socket is not read.

    QUEUED     a later turn of the event loop will send the next slice, or handle the next request
    ANSWERING  a task computes the response: the method waits, or a thread decodes or encodes a large value
    STALLED    the peer does not read, and the transport has paused writing

Data is written only in turns and at the end of a task, so a connection that is QUEUED or ANSWERING cannot
become STALLED. Three states are final, in this order:

    DRAINING   a request was refused: further bytes are discarded, up to a limit, until the peer stops sending
    CLOSING    everything has been written; the transport closes once the data has been sent
    CLOSED     aborted or lost

An event that is not in the table for a state has no effect.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class RpcState(Enum):
    """The state of a connection; see the module docstring."""

    READING = auto()
    QUEUED = auto()
    ANSWERING = auto()
    STALLED = auto()
    DRAINING = auto()
    CLOSING = auto()
    CLOSED = auto()


class RpcEvent(Enum):
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


BUSY: Final = frozenset({RpcState.QUEUED, RpcState.ANSWERING, RpcState.STALLED})
FINAL: Final = frozenset({RpcState.DRAINING, RpcState.CLOSING, RpcState.CLOSED})

_TRANSITIONS: Final[dict[RpcState, dict[RpcEvent, RpcState]]] = {
    RpcState.READING: {
        RpcEvent.TURN_QUEUED: RpcState.QUEUED,
        RpcEvent.TASK_BEGAN: RpcState.ANSWERING,
        RpcEvent.WRITING_PAUSED: RpcState.STALLED,
        RpcEvent.REQUEST_REFUSED: RpcState.DRAINING,
        RpcEvent.CLOSED_GRACEFULLY: RpcState.CLOSING,
        RpcEvent.ABORTED: RpcState.CLOSED,
    },
    RpcState.QUEUED: {RpcEvent.TURN_BEGAN: RpcState.READING, RpcEvent.ABORTED: RpcState.CLOSED},
    RpcState.ANSWERING: {RpcEvent.TASK_DONE: RpcState.READING, RpcEvent.ABORTED: RpcState.CLOSED},
    RpcState.STALLED: {
        RpcEvent.WRITING_RESUMED: RpcState.READING,
        # the response to the refused request filled the transport
        RpcEvent.REQUEST_REFUSED: RpcState.DRAINING,
        RpcEvent.CLOSED_GRACEFULLY: RpcState.CLOSING,
        RpcEvent.ABORTED: RpcState.CLOSED,
    },
    RpcState.DRAINING: {RpcEvent.CLOSED_GRACEFULLY: RpcState.CLOSING, RpcEvent.ABORTED: RpcState.CLOSED},
    RpcState.CLOSING: {RpcEvent.ABORTED: RpcState.CLOSED},
    RpcState.CLOSED: {},
}


def after(state: RpcState, event: RpcEvent) -> RpcState:
    """Return the state after an event.

    >>> after(RpcState.READING, RpcEvent.TASK_BEGAN), after(RpcState.CLOSED, RpcEvent.TASK_DONE)
    (<RpcState.ANSWERING: 3>, <RpcState.CLOSED: 7>)
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
