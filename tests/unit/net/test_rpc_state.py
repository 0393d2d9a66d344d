"""State transitions of a connection of the RPC server."""

from __future__ import annotations

import itertools

import pytest

from pipros.net.rpc_state import BUSY, FINAL, Event, State, Step, after, next_step


def run(*events: Event) -> State:
    state = State.READING
    for event in events:
        state = after(state, event)
    return state


@pytest.mark.parametrize("state", State)
def test_every_connection_can_be_aborted(state: State) -> None:
    assert after(state, Event.ABORTED) is State.CLOSED


@pytest.mark.parametrize("event", Event)
def test_a_closed_connection_stays_closed(event: Event) -> None:
    assert after(State.CLOSED, event) is State.CLOSED


def test_a_final_state_has_no_transitions() -> None:
    for state, event in itertools.product(FINAL, Event):
        assert after(state, event) in FINAL


@pytest.mark.parametrize(
    ("begin", "end", "state"),
    [
        (Event.TURN_QUEUED, Event.TURN_BEGAN, State.QUEUED),
        (Event.TASK_BEGAN, Event.TASK_DONE, State.ANSWERING),
        (Event.WRITING_PAUSED, Event.WRITING_RESUMED, State.STALLED),
    ],
)
def test_each_busy_state_is_left_only_by_its_own_end(begin: Event, end: Event, state: State) -> None:
    assert state in BUSY
    assert run(begin) is state
    assert run(begin, end) is State.READING
    for other in {Event.TURN_BEGAN, Event.TASK_DONE, Event.WRITING_RESUMED} - {end}:
        assert run(begin, other) is state


def test_a_graceful_close_waits_for_the_answer() -> None:
    assert run(Event.TASK_BEGAN, Event.CLOSED_GRACEFULLY) is State.ANSWERING
    assert run(Event.TURN_QUEUED, Event.CLOSED_GRACEFULLY) is State.QUEUED


def test_a_refusal_that_fills_the_transport_is_drained() -> None:
    assert run(Event.WRITING_PAUSED, Event.REQUEST_REFUSED) is State.DRAINING
    assert run(Event.WRITING_PAUSED, Event.REQUEST_REFUSED, Event.WRITING_RESUMED) is State.DRAINING
    assert run(Event.REQUEST_REFUSED, Event.CLOSED_GRACEFULLY) is State.CLOSING


@pytest.mark.parametrize("has_input", [False, True])
@pytest.mark.parametrize("has_peer_ended", [False, True])
class TestNextStep:
    def test_a_large_answer_is_sent_completely_first(self, has_input: bool, has_peer_ended: bool) -> None:
        for is_last in (False, True):
            step = next_step(
                has_unsent=True,
                is_last_answer=is_last,
                has_input=has_input,
                has_peer_ended=has_peer_ended,
            )
            assert step is Step.QUEUE_TURN

    def test_no_bytes_follow_the_last_response(self, has_input: bool, has_peer_ended: bool) -> None:
        step = next_step(
            has_unsent=False, is_last_answer=True, has_input=has_input, has_peer_ended=has_peer_ended
        )
        assert step is Step.CLOSE

    def test_pipelined_calls_of_a_closed_peer_are_answered(
        self, has_input: bool, has_peer_ended: bool
    ) -> None:
        step = next_step(
            has_unsent=False, is_last_answer=False, has_input=has_input, has_peer_ended=has_peer_ended
        )
        if has_input:
            assert step is Step.QUEUE_TURN
        else:
            assert step is (Step.CLOSE if has_peer_ended else Step.READ)
