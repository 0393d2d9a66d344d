"""The state machines of goals: one table each, and together."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_libraries.actions.client_goal import TRANSITIONS, ClientGoal, ClientGoalState
from pipros_libraries.actions.server_goal import TRANSITIONS as SERVER_TRANSITIONS
from pipros_libraries.actions.server_goal import GoalEvent, after, why_not
from pipros_libraries.actions.status import TERMINAL, Status


def test_a_goal_that_succeeds_goes_through_all_states() -> None:
    goal = ClientGoal()

    assert goal.on_status(Status.PENDING) == [ClientGoalState.PENDING]
    assert goal.on_status(Status.PENDING) == []
    assert goal.on_status(Status.ACTIVE) == [ClientGoalState.ACTIVE]
    assert goal.on_status(Status.SUCCEEDED) == [ClientGoalState.WAITING_FOR_RESULT]
    assert goal.on_result(Status.SUCCEEDED) == [ClientGoalState.DONE]
    assert goal.status is Status.SUCCEEDED


def test_a_result_before_any_status_passes_through_all_states() -> None:
    goal = ClientGoal()

    assert goal.on_result(Status.PREEMPTED) == [
        ClientGoalState.ACTIVE,
        ClientGoalState.PREEMPTING,
        ClientGoalState.WAITING_FOR_RESULT,
        ClientGoalState.DONE,
    ]
    assert goal.on_status(Status.ACTIVE) == []
    assert goal.on_result(Status.ABORTED) == []
    assert goal.status is Status.PREEMPTED


@pytest.mark.parametrize("status", [Status.PENDING, 17])
def test_a_result_with_an_impossible_status_ends_the_goal(status: int) -> None:
    goal = ClientGoal()
    goal.on_status(Status.ACTIVE)

    assert goal.on_result(status) == [ClientGoalState.DONE]
    assert goal.state is ClientGoalState.DONE


def test_a_finished_goal_cannot_be_cancelled() -> None:
    goal = ClientGoal()
    goal.on_result(Status.SUCCEEDED)

    assert goal.on_cancel() == []
    assert goal.on_status(None) == []
    assert goal.state is ClientGoalState.DONE


def test_a_goal_that_ends_while_it_is_cancelled_is_done() -> None:
    goal = ClientGoal()
    goal.on_status(Status.ACTIVE)

    assert goal.on_cancel() == [ClientGoalState.WAITING_FOR_CANCEL_ACK]
    assert goal.on_status(Status.SUCCEEDED) == [
        ClientGoalState.PREEMPTING,
        ClientGoalState.WAITING_FOR_RESULT,
    ]
    assert goal.on_cancel() == []
    assert goal.on_result(Status.SUCCEEDED) == [ClientGoalState.DONE]


def test_a_goal_missing_from_the_status_is_lost() -> None:
    goal = ClientGoal()
    assert goal.on_status(None) == []  # the server may not have seen it yet
    goal.on_status(Status.ACTIVE)

    assert goal.on_status(None) == [ClientGoalState.DONE]
    assert goal.status is Status.LOST


@pytest.mark.parametrize("status", [Status.PENDING, Status.REJECTED, 17])
def test_an_impossible_status_is_ignored(status: int) -> None:
    goal = ClientGoal()
    goal.on_status(Status.ACTIVE)

    with pytest.raises(ValueError, match=r"status|cannot be"):
        goal.on_status(status)
    assert goal.state is ClientGoalState.ACTIVE


def test_a_server_cannot_end_a_goal_twice() -> None:
    assert after(Status.PENDING, GoalEvent.SUCCEED) is None
    assert after(Status.ACTIVE, GoalEvent.SUCCEED) is Status.SUCCEEDED
    assert all(after(status, event) is None for status in TERMINAL for event in GoalEvent)
    assert "PENDING or RECALLING" in why_not(Status.ACTIVE, GoalEvent.ACCEPT)
    assert after(99, GoalEvent.ACCEPT) is None


EVENTS = st.lists(
    st.tuples(st.sampled_from([*GoalEvent, "cancel"]), st.booleans(), st.booleans()), max_size=12
)


@given(EVENTS)
def test_client_and_server_agree_after_any_events(events: list[tuple[GoalEvent | str, bool, bool]]) -> None:
    """The server's goal takes any path; the client sees some of its statuses, and finally the result."""
    status, client, way = Status.PENDING, ClientGoal(), []
    for event, is_status_seen, is_listed in events:
        if event == "cancel":
            way += client.on_cancel()
            event = GoalEvent.CANCEL_REQUESTED
        assert isinstance(event, GoalEvent)
        status = after(status, event) or status
        if is_status_seen and (is_listed or client.state is ClientGoalState.WAITING_FOR_GOAL_ACK):
            way += client.on_status(status if is_listed else None)
    if status in TERMINAL:
        way += client.on_result(status)
        assert client.state is ClientGoalState.DONE
        assert client.status is status
    assert way.count(ClientGoalState.DONE) <= 1
    assert ClientGoalState.DONE not in way[:-1]


@given(st.sampled_from(list(TRANSITIONS)), st.sampled_from(list(Status)))
def test_paths_end_at_a_stable_status(state: ClientGoalState, status: Status) -> None:
    way = TRANSITIONS[state].get(status)
    if way:
        assert TRANSITIONS[way[-1]].get(status, ()) == ()


def test_every_status_that_a_server_can_reach_is_known_to_clients() -> None:
    reachable = {new for changes in SERVER_TRANSITIONS.values() for new in changes.values()}

    assert reachable | {Status.PENDING} == set(TRANSITIONS[ClientGoalState.WAITING_FOR_GOAL_ACK])
