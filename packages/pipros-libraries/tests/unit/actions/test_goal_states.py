"""The state machines of goals: one table each, and together."""

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_libraries.actions.client_goal import TRANSITIONS, ClientGoal, ClientGoalState
from pipros_libraries.actions.goal_table import GoalTable, append_goal
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
        ClientGoalState.ACTIVE, ClientGoalState.PREEMPTING, ClientGoalState.WAITING_FOR_RESULT,
        ClientGoalState.DONE,
    ]  # fmt: skip
    assert (goal.on_status(Status.ACTIVE), goal.on_result(Status.ABORTED)) == ([], [])
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

    assert (goal.on_cancel(), goal.on_status(None)) == ([], [])
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


# The goals of an action server: found by id, and bounded.


@dataclass
class Goal:
    name: str
    has_ended: bool = False


@pytest.fixture
def table() -> GoalTable[Goal]:
    made: GoalTable[Goal] = GoalTable(3, 10, lambda goal: goal.has_ended)
    for name in "abc":
        assert made.add(name, Goal(name))
    return made


def names(table: GoalTable[Goal]) -> str:
    return "".join(goal.name for goal in table)


def test_a_full_table_refuses_goals_while_none_has_ended(table: GoalTable[Goal]) -> None:
    assert not table.add("d", Goal("d"))
    assert (names(table), table.find("d")) == ("abc", None)


def test_a_new_goal_replaces_the_oldest_that_has_ended(table: GoalTable[Goal]) -> None:
    for name in "cb":
        goal = table.find(name)
        goal.has_ended = True

    assert table.add("d", Goal("d"))
    assert names(table) == "acd"


def test_a_goal_that_is_added_again_replaces_only_itself(table: GoalTable[Goal]) -> None:
    for goal in table:
        goal.has_ended = True

    assert table.add("b", Goal("new b "))
    assert names(table) == "anew b c"


def test_discarded_goals_make_room(table: GoalTable[Goal]) -> None:
    table.keep(lambda goal: goal.name == "b")
    assert table.add("d", Goal("d"))
    assert names(table) == "bd"


def test_long_ids_are_refused(table: GoalTable[Goal]) -> None:
    table.keep(lambda _: False)
    assert not table.add("x" * 11, Goal("x"))
    assert table.add("x" * 10, Goal("x"))


@pytest.mark.parametrize(("goal_id", "stamp", "expected"), [
    ("", 0, "abc"), ("b", 0, "b"), ("x", 0, ""), ("", 98, "ab"), ("c", 97, "ac"), ("x", 97, "a")
])  # fmt: skip
def test_a_cancellation_means_a_goal_or_those_up_to_a_stamp(
    table: GoalTable[Goal], goal_id: str, stamp: int, expected: str
) -> None:
    meant = table.meant_by(goal_id, stamp, lambda goal: ord(goal.name))

    assert "".join(goal.name for goal in meant) == expected


def appended(ended: str, limit: int) -> str:
    """Goals after the goal d was appended to a, b and c; names in `ended` are goals that have ended."""
    goals = list("abc")
    assert append_goal(goals, "d", limit, lambda goal: goal in ended) is ("d" in goals)
    return "".join(goals)


def test_a_list_with_room_keeps_all_goals() -> None:
    assert appended(ended="a", limit=4) == "abcd"


def test_in_a_full_list_a_goal_replaces_the_oldest_that_has_ended_or_is_refused() -> None:
    assert (appended(ended="cb", limit=3), appended(ended="", limit=3)) == ("acd", "abc")
