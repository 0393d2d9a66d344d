"""The action server of move_base, with messages given directly."""

from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros_libraries.actions import feedback_first
from pipros_libraries.actions.goal_server import REPLACED, STATUSES_AT_ONCE, GoalServer
from pipros_libraries.actions.server_goal import GoalEvent
from pipros_libraries.actions.status import Status

GOAL: Any = load_message_class("move_base_msgs/MoveBaseActionGoal")
CANCEL: Any = load_message_class("actionlib_msgs/GoalID")


class FakeNode:
    """A node whose topics are lists and functions."""

    name = "/move_base"

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.sent: dict[str, list[Any]] = {}
        self.callbacks: dict[str, Any] = {}
        self.warnings: list[str] = []
        self.log = SimpleNamespace(warning=self.warnings.append)
        self.now_s = 10
        self.clock = SimpleNamespace(now_ns=lambda: self.now_s * 1_000_000_000)

    def advertise(self, topic: str, _: Any, **__: Any) -> Any:
        return SimpleNamespace(publish=self.sent.setdefault(topic, []).append, connection_count=1)

    def subscribe(self, topic: str, _: Any, callback: Any, **__: Any) -> None:
        self.callbacks[topic] = callback


class Server:
    """A `GoalServer` with short names for what clients do."""

    def __init__(self, limits: Limits | None = None) -> None:
        node: Any = FakeNode(limits or Limits())
        self.node = node
        self.woken = 0
        schedule: Any = SimpleNamespace(every=lambda _, do: setattr(self, "tick", do))
        self.goals = GoalServer(node, "move_base", "move_base_msgs/MoveBase", schedule, self.wake)
        self.tick: Any

    def wake(self) -> None:
        self.woken += 1

    def send(self, name: str, stamp_s: int = 0) -> None:
        goal = GOAL()
        goal.goal_id.id, goal.goal_id.stamp = name, Time(stamp_s, 0)
        self.node.callbacks["move_base/goal"](goal)

    def cancel(self, name: str = "", stamp_s: int = 0) -> None:
        self.node.callbacks["move_base/cancel"](CANCEL(Time(stamp_s, 0), name))

    @property
    def results(self) -> list[tuple[str, int, str]]:
        sent = self.node.sent["move_base/result"]
        return [(each.status.goal_id.id, each.status.status, each.status.text) for each in sent]

    @property
    def statuses(self) -> dict[str, int]:
        listed = self.node.sent["move_base/status"][-1].status_list
        return {each.goal_id.id: each.status for each in listed}


def test_a_goal_is_accepted_succeeds_and_is_forgotten_after_a_while() -> None:
    server = Server()
    server.send("a")
    assert (server.woken, server.goals.has_new_goal, server.goals.is_active) == (1, True, False)
    server.goals.accept()
    assert (server.statuses, server.goals.is_active) == ({"a": Status.ACTIVE}, True)
    server.goals.publish_feedback(load_message_class("move_base_msgs/MoveBaseFeedback")())
    assert server.node.sent["move_base/feedback"][0].status.goal_id.id == "a"
    server.goals.end(GoalEvent.SUCCEED, "Goal reached.")
    assert server.results == [("a", Status.SUCCEEDED, "Goal reached.")]
    server.goals.end(GoalEvent.ABORT, "too late")
    assert len(server.results) == 1
    server.tick()
    assert server.statuses == {"a": Status.SUCCEEDED}
    server.node.now_s += 6
    server.tick()
    assert server.statuses == {}


def test_a_result_does_not_follow_its_feedback_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    server, slept = Server(), []

    def sleep(seconds: float) -> None:
        assert not server.results
        slept.append(seconds)

    time = SimpleNamespace(monotonic=lambda: 5.0, sleep=sleep)
    monkeypatch.setattr(feedback_first, "time", time)
    server.send("a")
    server.goals.accept()
    server.goals.publish_feedback(load_message_class("move_base_msgs/MoveBaseFeedback")())
    server.goals.end(GoalEvent.SUCCEED, "")
    assert slept == [pytest.approx(feedback_first.FEEDBACK_FIRST_S)]
    time.monotonic = lambda: 5.0 + feedback_first.FEEDBACK_FIRST_S
    server.send("b")
    server.goals.accept()
    server.goals.end(GoalEvent.SUCCEED, "")
    assert (len(slept), [name for name, *_ in server.results]) == (1, ["a", "b"])


def test_a_new_goal_replaces_the_active_and_the_waiting_one() -> None:
    server = Server()
    for name in ("a", "b", "c"):
        server.send(name)
        if name == "a":
            server.goals.accept()
    assert server.results == [("b", Status.RECALLED, REPLACED)]
    server.goals.accept()
    assert server.results[1:] == [("a", Status.PREEMPTED, REPLACED)]
    assert server.statuses["c"] == Status.ACTIVE
    server.send("old", stamp_s=1)
    assert server.results[2:] == [("old", Status.RECALLED, REPLACED)]
    server.send("c")
    assert not server.goals.has_new_goal, "a goal that is sent twice is one goal"


def test_goals_without_an_id_get_one_of_their_own() -> None:
    server = Server()
    server.send("")
    server.goals.accept()
    server.send("")
    assert len(server.statuses) == 1
    server.goals.accept()
    assert [status for _, status, _ in server.results] == [Status.PREEMPTED]


@pytest.mark.parametrize("name", ["a", ""])
def test_cancellation_is_requested_and_then_carried_out(name: str) -> None:
    server = Server()
    server.send("a")
    server.goals.accept()
    server.cancel(name)
    assert (server.statuses, server.goals.is_cancelled) == ({"a": Status.PREEMPTING}, True)
    server.goals.end(GoalEvent.CANCEL, "")
    assert (server.results, server.goals.is_cancelled) == ([("a", Status.PREEMPTED, "")], False)


def test_a_waiting_goal_stays_cancelled_when_it_is_accepted() -> None:
    server = Server()
    server.send("a")
    server.cancel("a")
    assert not server.goals.is_cancelled
    server.goals.accept()
    assert server.goals.is_cancelled


def test_a_goal_that_was_cancelled_before_it_arrived_is_recalled() -> None:
    server = Server()
    server.cancel("a")
    server.send("a")
    assert server.results == [("a", Status.RECALLED, "")]
    server.cancel(stamp_s=20)
    server.send("b", stamp_s=15)
    assert server.results[1:] == [("b", Status.RECALLED, REPLACED)]
    assert not server.goals.has_new_goal
    with pytest.raises(RuntimeError, match="without a new goal"):
        server.goals.accept()


def test_too_many_goals_are_rejected() -> None:
    server = Server(Limits(goals=1))
    server.send("a")
    server.send("b")
    assert server.results == [
        ("b", Status.REJECTED, "this action server has too many goals, or the goal ID is too long")
    ]
    assert server.node.warnings == ["a goal is rejected: there are too many goals, or its ID is too long"]


def test_goals_are_accepted_and_ended_ones_forgotten_after_the_time_has_moved_back() -> None:
    server = Server()
    server.send("old", stamp_s=9)
    server.goals.accept()
    server.goals.end(GoalEvent.SUCCEED, "")
    server.send("waiting", stamp_s=10)
    server.cancel(stamp_s=8)
    server.node.now_s = 2
    server.send("new", stamp_s=1)
    assert server.results[1:] == [("waiting", Status.RECALLED, REPLACED)]
    server.goals.accept()
    server.tick()
    assert server.statuses == {"waiting": Status.RECALLED, "new": Status.ACTIVE}


def test_a_flood_of_goals_lists_each_in_the_periodic_status_only() -> None:
    server = Server()
    names = [f"goal {index}" for index in range(3 * STATUSES_AT_ONCE)]
    for name in names:
        server.send(name)
        server.goals.accept()
    listed = server.node.sent["move_base/status"]
    count = len(listed)
    assert sum(len(each.status_list) for each in listed) < 2 * STATUSES_AT_ONCE**2 + STATUSES_AT_ONCE
    assert [name for name, status, _ in server.results if status == Status.PREEMPTED] == names[:-1]
    server.tick()
    assert len(listed) == count + 1
    assert server.statuses == dict.fromkeys(names[:-1], Status.PREEMPTED) | {names[-1]: Status.ACTIVE}


def test_a_published_status_does_not_change_afterwards() -> None:
    server = Server()
    server.send("a")
    server.goals.accept()
    accepted = server.node.sent["move_base/status"][-1].status_list[0]
    server.goals.end(GoalEvent.SUCCEED, "there")
    assert (accepted.status, server.statuses) == (Status.ACTIVE, {"a": Status.SUCCEEDED})
