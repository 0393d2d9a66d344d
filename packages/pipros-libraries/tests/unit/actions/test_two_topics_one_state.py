"""An action client shows one state, although statuses and results arrive on two topics."""

from collections.abc import Callable
from threading import Timer
from typing import Any

import pytest

import actionlib.action_client
import actionlib.simple_action_client
import rospy
from actionlib.action_client import GoalManager
from pipros.msg import load_message_class
from pipros_libraries.actions.client_goal import LOST_RESULT_S
from pipros_libraries.actions.status import Status

Action: Any = load_message_class("actionlib/TestAction")
Goal: Any = load_message_class("actionlib/TestGoal")
GoalStatus: Any = load_message_class("actionlib_msgs/GoalStatus")
GoalStatusArray: Any = load_message_class("actionlib_msgs/GoalStatusArray")


class Server:
    """The topics of a server, without connections, for one simple client that has sent a goal."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.manager = GoalManager(Action)
        self.manager.register_send_goal_fn(self._receive)
        self.ended: list[tuple[int, int]] = []
        monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time(1))
        monkeypatch.setattr(rospy, "get_rostime", rospy.Time.now)
        monkeypatch.setattr(actionlib.simple_action_client, "ActionClient", lambda *_: self)
        self.client = actionlib.SimpleActionClient("act", Action)
        self.client.send_goal(Goal(1), done_cb=lambda status, got: self.ended.append((status, got.result)))

    def send_goal(self, *goal: Any) -> Any:
        return self.manager.init_goal(*goal)

    def _receive(self, goal: Any) -> None:
        self.goal_id = goal.goal_id

    def report(self, status: Status | None) -> None:
        reported = [] if status is None else [GoalStatus(self.goal_id, int(status), "")]
        self.manager.update_statuses(GoalStatusArray(status_list=reported))

    def end(self, status: Status, value: int) -> None:
        result = self.manager.ActionResult(status=GoalStatus(self.goal_id, int(status), ""))
        result.result.result = value
        self.manager.update_results(result)

    def seen(self) -> tuple[int, int | None]:
        """Return what a program that polls the client sees: the state, and the value of the result."""
        result = self.client.get_result()
        return self.client.get_state(), None if result is None else result.result


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Server:
    return Server(monkeypatch)


@pytest.mark.parametrize("status", [Status.SUCCEEDED, Status.ABORTED, Status.PREEMPTED, Status.REJECTED])
def test_a_final_state_is_seen_only_with_its_result(server: Server, status: Status) -> None:
    server.report(status)
    state, result = server.seen()
    assert state in (Status.PENDING, Status.ACTIVE)
    assert result is None
    server.end(status, 7)
    assert (server.seen(), server.ended) == ((status, 7), [(status, 7)])


def test_a_status_after_the_result_changes_nothing(server: Server) -> None:
    server.end(Status.SUCCEEDED, 7)
    for late in (Status.ACTIVE, Status.ABORTED, None):
        server.report(late)
        assert server.seen() == (Status.SUCCEEDED, 7)
    server.end(Status.ABORTED, 8)
    assert (server.seen(), server.ended) == ((Status.SUCCEEDED, 7), [(Status.SUCCEEDED, 7)])


def test_a_result_during_a_callback_is_seen_after_it(monkeypatch: pytest.MonkeyPatch, server: Server) -> None:
    seen = []

    def receive_the_result() -> None:
        server.end(Status.SUCCEEDED, 7)
        seen.append(server.seen())

    monkeypatch.setattr(server.client, "active_cb", receive_the_result)
    server.report(Status.ACTIVE)
    assert (seen, server.seen()) == ([(Status.ACTIVE, None)], (Status.SUCCEEDED, 7))


def test_a_lost_result_ends_the_goal_with_its_status(monkeypatch: pytest.MonkeyPatch, server: Server) -> None:
    monkeypatch.setattr(server.client, "done_cb", lambda status, got: server.ended.append((status, got)))
    clock: Callable[[], float] = lambda: now_s  # noqa: E731
    monkeypatch.setattr(actionlib.action_client, "monotonic", clock)
    now_s = 100.0
    server.report(Status.SUCCEEDED)
    server.report(None)
    now_s += LOST_RESULT_S - 1
    server.report(None)
    assert server.ended == []
    now_s += 2
    server.report(None)
    assert (server.ended, server.seen()) == ([(Status.SUCCEEDED, None)], (Status.SUCCEEDED, None))


@pytest.mark.parametrize("seconds", [0, -1])
def test_a_wait_lasts_until_the_result_unless_its_timeout_is_positive(server: Server, seconds: int) -> None:
    Timer(0.05, server.end, (Status.SUCCEEDED, 7)).start()
    assert server.client.wait_for_result(rospy.Duration(seconds))
