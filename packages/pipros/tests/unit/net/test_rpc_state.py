"""State transitions of a connection of the RPC server."""

from __future__ import annotations

import itertools

import pytest

from pipros.net.rpc_state import BUSY, FINAL, RpcEvent, RpcState, Step, after, next_step


def run(*events: RpcEvent) -> RpcState:
    state = RpcState.READING
    for event in events:
        state = after(state, event)
    return state


@pytest.mark.parametrize("state", RpcState)
def test_every_connection_can_be_aborted(state: RpcState) -> None:
    assert after(state, RpcEvent.ABORTED) is RpcState.CLOSED


@pytest.mark.parametrize("event", RpcEvent)
def test_a_closed_connection_stays_closed(event: RpcEvent) -> None:
    assert after(RpcState.CLOSED, event) is RpcState.CLOSED


def test_a_final_state_has_no_transitions() -> None:
    for state, event in itertools.product(FINAL, RpcEvent):
        assert after(state, event) in FINAL


@pytest.mark.parametrize(
    ("begin", "end", "state"),
    [
        (RpcEvent.TURN_QUEUED, RpcEvent.TURN_BEGAN, RpcState.QUEUED),
        (RpcEvent.TASK_BEGAN, RpcEvent.TASK_DONE, RpcState.ANSWERING),
        (RpcEvent.WRITING_PAUSED, RpcEvent.WRITING_RESUMED, RpcState.STALLED),
    ],
)
def test_each_busy_state_is_left_only_by_its_own_end(begin: RpcEvent, end: RpcEvent, state: RpcState) -> None:
    assert state in BUSY
    assert run(begin) is state
    assert run(begin, end) is RpcState.READING
    for other in {RpcEvent.TURN_BEGAN, RpcEvent.TASK_DONE, RpcEvent.WRITING_RESUMED} - {end}:
        assert run(begin, other) is state


def test_a_graceful_close_waits_for_the_answer() -> None:
    assert run(RpcEvent.TASK_BEGAN, RpcEvent.CLOSED_GRACEFULLY) is RpcState.ANSWERING
    assert run(RpcEvent.TURN_QUEUED, RpcEvent.CLOSED_GRACEFULLY) is RpcState.QUEUED


def test_a_refusal_that_fills_the_transport_is_drained() -> None:
    assert run(RpcEvent.WRITING_PAUSED, RpcEvent.REQUEST_REFUSED) is RpcState.DRAINING
    assert (
        run(RpcEvent.WRITING_PAUSED, RpcEvent.REQUEST_REFUSED, RpcEvent.WRITING_RESUMED) is RpcState.DRAINING
    )
    assert run(RpcEvent.REQUEST_REFUSED, RpcEvent.CLOSED_GRACEFULLY) is RpcState.CLOSING


EITHER = (False, True)
STEPS = [
    ((True,), EITHER, EITHER, EITHER, Step.QUEUE_TURN),  # a large answer is sent completely first
    ((False,), (True,), EITHER, EITHER, Step.CLOSE),  # no bytes follow the last response
    ((False,), (False,), (True,), EITHER, Step.QUEUE_TURN),  # also calls of a peer that has closed its half
    ((False,), (False,), (False,), (True,), Step.CLOSE),
    ((False,), (False,), (False,), (False,), Step.READ),
]


@pytest.mark.parametrize(("unsent", "last", "inputs", "ended", "step"), STEPS)
def test_answers_are_sent_before_calls_are_read_or_the_connection_is_closed(
    unsent: tuple[bool], last: tuple[bool], inputs: tuple[bool], ended: tuple[bool], step: Step
) -> None:
    for each in itertools.product(unsent, last, inputs, ended):
        names = ("has_unsent", "is_last_answer", "has_input", "has_peer_ended")
        assert next_step(**dict(zip(names, each, strict=True))) is step
