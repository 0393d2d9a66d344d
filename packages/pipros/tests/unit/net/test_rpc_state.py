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
