"""Actions through a gateway: two gateways back to back, and an engine as the other side."""

import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.actions.status import Status
from pipros_ros2 import action_messages as messages
from pipros_ros2.action_messages import CancelCode, GoalInfo, Ros2Status
from pipros_ros2.interface import EndpointKind, Ros2Caller
from pipros_tools.graph.system_state import read_state
from tests.support.ros2_domains import free_domain
from tests.support.ros2_gateways import PAIRS, System
from tests.support.waiting import wait_until

FIBONACCI = "actionlib_tutorials/Fibonacci"
PAIR = PAIRS.of_action(FIBONACCI)
GoalID: Any = load_message_class("actionlib_msgs/GoalID")
GoalStatus: Any = load_message_class("actionlib_msgs/GoalStatus")
GoalStatusArray: Any = load_message_class("actionlib_msgs/GoalStatusArray")
Goal, Result, Feedback = (load_message_class(f"{FIBONACCI}{part}") for part in ("Goal", "Result", "Feedback"))
ALLOWED = "actions: {to_ros1: {allow: [/fibonacci]}}"
ID = bytes(range(16))


class Server:
    """A ROS 1 action server: rejects negative orders, and executes others until the test ends them."""

    def __init__(self, node: Node) -> None:
        self.goals: list[Any] = []
        self.cancelled: list[str] = []
        self._statuses: dict[str, Any] = {}
        self._status = node.advertise("/fibonacci/status", GoalStatusArray)
        self._result = node.advertise("/fibonacci/result", PAIR.result)
        self._feedback = node.advertise("/fibonacci/feedback", PAIR.feedback)
        self._subscribers = (
            node.subscribe("/fibonacci/goal", PAIR.goal, self._on_goal),
            node.subscribe("/fibonacci/cancel", GoalID, lambda message: self.cancelled.append(message.id)),
        )

    def close(self) -> None:
        for each in (self._status, self._result, self._feedback, *self._subscribers):
            each.unregister()

    def _on_goal(self, message: Any) -> None:
        self.goals.append(message)
        if message.goal.order < 0:
            self.end(message, Status.REJECTED)
        else:
            self._publish(GoalStatus(message.goal_id, int(Status.ACTIVE), ""))

    def _publish(self, status: Any) -> None:
        self._statuses[status.goal_id.id] = status
        self._status.publish(GoalStatusArray(status_list=[*self._statuses.values()]))

    def report(self, goal: Any, sequence: list[int]) -> None:
        status = GoalStatus(goal.goal_id, 1, "")
        self._feedback.publish(PAIR.feedback(status=status, feedback=Feedback(sequence)))

    def end(self, goal: Any, status: Status, sequence: list[int] | None = None) -> None:
        ended = GoalStatus(goal.goal_id, int(status), "")
        self._result.publish(PAIR.result(status=ended, result=Result(sequence or [])))
        self._publish(ended)


class Client:
    """A ROS 1 action client."""

    def __init__(self, node: Node) -> None:
        self.feedback: list[Any] = []
        self.results: dict[str, Any] = {}
        self.statuses: dict[str, int] = {}
        self._goal = node.advertise("/fibonacci/goal", PAIR.goal)
        self.cancel = node.advertise("/fibonacci/cancel", GoalID)
        self._ends = (
            self._goal,
            self.cancel,
            node.subscribe("/fibonacci/feedback", PAIR.feedback, self.feedback.append),
            node.subscribe("/fibonacci/result", PAIR.result, self._on_result),
            node.subscribe("/fibonacci/status", GoalStatusArray, self._on_status),
        )

    def _on_result(self, message: Any) -> None:
        self.results[message.status.goal_id.id] = message

    def _on_status(self, message: Any) -> None:
        self.statuses |= {each.goal_id.id: each.status for each in message.status_list}

    def send(self, goal_id: str, order: int) -> None:
        wait_until(lambda: all(each.connection_count for each in self._ends), what="a server")
        self._goal.publish(PAIR.goal(goal_id=GoalID(id=goal_id), goal=Goal(order)))

    def result(self, goal_id: str) -> tuple[int, tuple[int, ...]]:
        wait_until(lambda: goal_id in self.results, what=f"the result of {goal_id}")
        message = self.results[goal_id]
        return message.status.status, tuple(message.result.sequence)


def published(system: System) -> set[str]:
    """Return the topics that have publishers."""
    found = read_state(system.ros1.master)
    assert found is not None
    return {topic for topic, nodes in found[0].publishers.items() if nodes}


@pytest.fixture(params=["rtps", "zenoh"])
def system(request: pytest.FixtureRequest) -> Iterator[System]:
    with free_domain() as domain:
        system = System(domain, has_zenoh=request.param == "zenoh")
        yield system
        system.close()


def caller(system: System, service: str) -> Ros2Caller:
    name = f"/fibonacci/_action/{service}"
    kind = {"send_goal": PAIR.send_goal, "get_result": PAIR.get_result, "cancel_goal": PAIR.cancel_goal}
    found = system.ros2.caller(name, kind[service], getattr(PAIR.hashes, service))
    wait_until(lambda: found.is_available, what=service)
    return found


def test_goals_pass_two_gateways_with_feedback_result_and_cancellation(system: System) -> None:
    server = Server(system.ros1)
    system.gateway(ALLOWED)
    other = system.new_master()
    system.gateway(master_uri=other)
    client = Client(system.node("client", other))

    client.send("first", 5)
    wait_until(lambda: server.goals, what="the goal")
    assert server.goals[0].goal.order == 5
    wait_until(lambda: client.statuses.get("first") == Status.ACTIVE, what="the status")
    server.report(server.goals[0], [0, 1])
    wait_until(lambda: client.feedback, what="feedback")
    assert (client.feedback[0].status.goal_id.id, [*client.feedback[0].feedback.sequence]) == (
        "first",
        [0, 1],
    )
    client.send("second", 6)
    client.send("third", -1)
    assert client.result("third") == (Status.REJECTED, ())
    wait_until(lambda: len(server.goals) == 3, what="all goals")
    second = next(each for each in server.goals if each.goal.order == 6)
    client.cancel.publish(GoalID(id="second"))
    wait_until(lambda: server.cancelled, what="the cancellation")
    assert server.cancelled == [second.goal_id.id]
    server.end(second, Status.PREEMPTED, [0])
    assert client.result("second") == (Status.PREEMPTED, (0,))
    server.end(server.goals[0], Status.SUCCEEDED, [0, 1, 1])
    assert client.result("first") == (Status.SUCCEEDED, (0, 1, 1))


def test_actions_of_ros1_are_offered_only_if_allowed(system: System) -> None:
    server = Server(system.ros1)
    gateway = system.gateway()

    wait_until(lambda: gateway.status().left_out, what="the reason")

    assert gateway.status().left_out.keys() == {"actions: to_ros1: /fibonacci"}
    assert not system.has(EndpointKind.SERVER, "/fibonacci/_action/send_goal")
    assert not server.goals


def test_a_goal_reaches_a_server_of_ros1_that_restarts(system: System) -> None:
    """The gateway keeps its topics meanwhile: rospy may lose a publisher that comes back at once."""
    first = Server(system.ros1)
    system.gateway(ALLOWED)
    send_goal = caller(system, "send_goal")
    watcher = system.node("watcher")
    seen = watcher.subscribe("/fibonacci/cancel", GoalID, lambda _: None)
    wait_until(lambda: seen.connection_count == 1, what="the gateway's publisher")

    first.close()
    wait_until(lambda: "/fibonacci/status" not in published(system), what="the end of the server")
    time.sleep(0.5)  # ten looks of the gateway at the master
    second = Server(system.ros1)

    reply = send_goal.call(messages.with_id(ID, PAIR.goal_to_cdr(Goal(5))), 60.0)
    assert messages.is_accepted(reply)
    assert [each.goal.order for each in second.goals] == [5]
    assert seen.statistics()["links_ended"] == 0


def test_a_result_does_not_wait_for_the_goals_that_the_same_client_still_waits_for(system: System) -> None:
    server = Server(system.ros1)
    system.gateway(ALLOWED)
    send_goal, get_result = caller(system, "send_goal"), caller(system, "get_result")
    ids = [bytes([number]) * 16 for number in range(20)]
    for number, each in enumerate(ids):
        assert messages.is_accepted(
            send_goal.call(messages.with_id(each, PAIR.goal_to_cdr(Goal(number))), 60.0)
        )
    with ThreadPoolExecutor(len(ids)) as executor:
        replies = [executor.submit(get_result.call, messages.with_id(each, b""), 20.0) for each in ids]
        for goal in sorted(server.goals, key=lambda each: -each.goal.order):  # the last one first
            server.end(goal, Status.SUCCEEDED, [goal.goal.order])
            status, result = PAIR.result_to_ros1(replies[goal.goal.order].result())
            assert (status, [*result.sequence]) == (Ros2Status.SUCCEEDED, [goal.goal.order])


def test_clients_of_ros2_get_errors_for_goals_that_do_not_exist(system: System) -> None:
    Server(system.ros1)
    system.gateway(ALLOWED)

    result = caller(system, "get_result").call(messages.with_id(ID, b""), 60.0)
    cancelled = caller(system, "cancel_goal").call(messages.cancel_request(GoalInfo(ID)), 60.0)

    assert PAIR.result_to_ros1(result)[0] is Ros2Status.UNKNOWN
    assert cancelled == messages.cancel_reply(CancelCode.UNKNOWN_GOAL, [])


def test_goals_are_aborted_if_the_server_of_ros2_disappears(system: System) -> None:
    system.gateway()
    peer, ended = system.engine(), threading.Event()

    def wait(_: bytes) -> bytes:
        ended.wait(60)
        raise TimeoutError

    prefix = "/fibonacci/_action"
    peer.serve(f"{prefix}/send_goal", PAIR.send_goal, PAIR.hashes.send_goal, accept)
    peer.serve(f"{prefix}/get_result", PAIR.get_result, PAIR.hashes.get_result, wait)
    peer.serve(f"{prefix}/cancel_goal", PAIR.cancel_goal, PAIR.hashes.cancel_goal, wait)
    client = Client(system.ros1)
    client.send("goal", 5)
    wait_until(lambda: client.statuses.get("goal") == Status.PENDING, what="the status")

    peer.close()
    ended.set()

    assert client.result("goal") == (Status.ABORTED, ())


def accept(_: bytes) -> bytes:
    return messages.accepted_reply(0, is_accepted=True)
