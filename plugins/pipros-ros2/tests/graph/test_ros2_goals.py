"""The goals of actions through a gateway, with an engine whose answers the test controls."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.limits import Limits
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import WallClock
from pipros_libraries.actions.status import Status
from pipros_ros2 import action_messages as messages
from pipros_ros2.action_messages import Ros2Status
from pipros_ros2.action_to_ros1 import ActionToRos1
from pipros_ros2.action_to_ros2 import ActionToRos2
from pipros_ros2.interface import Ros2CallFailed
from tests.support.constants import Constants
from tests.support.ros2_gateways import PAIRS
from tests.support.waiting import wait_until

PAIR = PAIRS.of_action("actionlib_tutorials/Fibonacci")
GoalID: Any = load_message_class("actionlib_msgs/GoalID")
GoalStatus: Any = load_message_class("actionlib_msgs/GoalStatus")
Goal: Any = load_message_class("actionlib_tutorials/FibonacciGoal")
Result: Any = load_message_class("actionlib_tutorials/FibonacciResult")
FEW = Limits(goals=2)
NAMES = {messages.id_in_ros2(each): each for each in ("first", "second", "marker")}


class Service:
    """A ROS 2 service whose answers are requested, and given when the test allows it."""

    is_available = True

    def __init__(self, name: str, log: list[str]) -> None:
        self.is_open = threading.Event()
        self.reply = b""
        self._name = name
        self._log = log

    def call(self, request: bytes, _timeout_s: float) -> bytes:
        goal = messages.split_id(request)[0]
        self._log.append(f"{self._name} {NAMES.get(goal, '?')}")
        self.is_open.wait(60)
        if not self.reply:
            raise Ros2CallFailed("no answer")
        self._log.append(f"{self._name} {NAMES.get(goal, '?')}: answered")
        return self.reply

    def close(self) -> None:
        self.is_open.set()


class Engine:
    """An engine that records what a gateway does in ROS 2."""

    def __init__(self) -> None:
        self.log: list[str] = []
        self.callers = {each: Service(each, self.log) for each in ("send_goal", "get_result", "cancel_goal")}
        self.services: dict[str, Callable[[bytes], bytes]] = {}

    def advertise(self, *_: object) -> Engine:
        return self

    subscribe = advertise

    def caller(self, service: str, *_: object) -> Service:
        return self.callers[service.rpartition("/")[2]]

    def publish(self, payload: bytes) -> None:
        """Accept what the gateway publishes in ROS 2."""

    def serve(self, service: str, _kind: str, _hash: str, answer: Any, _parts: object) -> Engine:
        self.services[service.rpartition("/")[2]] = answer
        return self

    def close(self) -> None:
        """Nothing is open."""


@pytest.fixture
def master_uri() -> Iterator[str]:
    with Master(port=0) as master:
        yield master.uri


@pytest.fixture
def node(master_uri: str) -> Iterator[Node]:
    with Node("ros1", environment=Environment(master_uri=master_uri)) as node:
        yield node


@pytest.fixture
def gateway(master_uri: str, constants: Constants) -> Iterator[Node]:
    constants(ROS2_CALLS=1, ROS2_HISTORY_BYTES=150)
    with Node("gateway", environment=Environment(master_uri=master_uri), limits=FEW) as node:
        yield node


def test_results_of_replaced_goals_do_not_count_towards_the_limit(node: Node, gateway: Node) -> None:
    engine: Any = Engine()
    action = ActionToRos1(gateway, engine, "/fibonacci", [PAIR], "id")
    results = node.advertise("/fibonacci/result", PAIR.result)
    wait_until(lambda: results.connection_count, what="the gateway")

    def status_of(goal_id: str) -> Ros2Status:
        request = messages.with_id(messages.id_in_ros2(goal_id), b"")
        return PAIR.result_to_ros1(engine.services["get_result"](request))[0]

    for name in "abcdef":
        ended = GoalStatus(GoalID(id=name), int(Status.SUCCEEDED), "")
        results.publish(PAIR.result(status=ended, result=Result(list(range(10)))))
    wait_until(lambda: status_of("f") is Ros2Status.SUCCEEDED, what="the last result")

    assert [status_of(each) for each in "de"] == [Ros2Status.UNKNOWN, Ros2Status.SUCCEEDED]
    action.close()


class Client:
    """A ROS 1 client of an action that a gateway offers."""

    def __init__(self, node: Node, gateway: Node) -> None:
        self.engine = Engine()
        self.send, self.result, self.cancel = (
            self.engine.callers[each] for each in ("send_goal", "get_result", "cancel_goal")
        )
        self.send.reply = messages.accepted_reply(0, is_accepted=True)
        self.result.reply = PAIR.result_to_cdr(Ros2Status.SUCCEEDED)
        self.cancel.reply = messages.cancel_reply(messages.CancelCode.NONE, [])
        engine: Any = self.engine
        self.action = ActionToRos2(gateway, engine, "/fibonacci", PAIR, "id")
        self.results: dict[str, int] = {}
        results = node.subscribe("/fibonacci/result", PAIR.result, self._on_result)
        self._goals = node.advertise("/fibonacci/goal", PAIR.goal)
        self._cancellations = node.advertise("/fibonacci/cancel", GoalID)
        for each in (results, self._goals, self._cancellations):
            wait_until(lambda each=each: each.connection_count, what="the gateway")  # type: ignore[misc]

    def _on_result(self, message: Any) -> None:
        self.results[message.status.goal_id.id] = message.status.status

    def start(self, goal_id: str) -> None:
        """Send a goal, and wait until the gateway has received it."""
        calls = self.action.counts.passed
        self._goals.publish(PAIR.goal(goal_id=GoalID(id=goal_id), goal=Goal(3)))
        wait_until(lambda: self.action.counts.passed > calls, what=goal_id)

    def request_cancel(self, *goal_ids: str) -> None:
        for each in goal_ids:
            self._cancellations.publish(GoalID(id=each))

    def wait_for(self, *expected: str) -> None:
        wait_until(lambda: set(expected) <= set(self.engine.log), what=f"{expected}")


@pytest.fixture
def client(node: Node, gateway: Node) -> Iterator[Client]:
    client = Client(node, gateway)
    yield client
    for each in client.engine.callers.values():
        each.close()
    client.action.close()


def test_goals_cancelled_before_the_server_accepts_them_are_cancelled_afterwards(client: Client) -> None:
    client.cancel.is_open.set()
    client.start("first")
    client.wait_for("send_goal first")
    client.request_cancel("first", "marker")
    client.wait_for("cancel_goal marker")
    client.send.is_open.set()
    client.wait_for("send_goal first: answered", "cancel_goal first")

    log = client.engine.log
    assert log.index("send_goal first: answered") < log.index("cancel_goal first")


@pytest.mark.parametrize("cancelled", ["second", ""])
def test_queued_goals_that_are_cancelled_are_not_sent(client: Client, cancelled: str) -> None:
    client.send.is_open.set()
    client.cancel.is_open.set()
    client.start("first")
    client.wait_for("get_result first")
    client.start("second")
    client.request_cancel(cancelled, "marker")
    client.wait_for("cancel_goal marker")
    client.result.is_open.set()
    wait_until(lambda: len(client.results) == 2, what="both results")

    assert client.results == {"first": Status.SUCCEEDED, "second": Status.RECALLED}
    assert "send_goal second" not in client.engine.log


def test_goals_that_arrive_after_their_cancellation_are_not_sent(client: Client) -> None:
    """They are sent on different connections, so that their order is not guaranteed."""
    for each in client.engine.callers.values():
        each.is_open.set()
    client.request_cancel("second", "marker")
    client.wait_for("cancel_goal marker")
    client.start("second")
    wait_until(lambda: client.results, what="the result")

    assert client.results == {"second": Status.RECALLED}
    assert "send_goal second" not in client.engine.log


def test_goals_that_the_server_does_not_answer_are_cancelled(client: Client) -> None:
    client.send.reply = b""
    client.send.is_open.set()
    client.start("first")
    wait_until(lambda: client.results, what="the result")
    client.wait_for("cancel_goal first")

    assert client.results == {"first": Status.ABORTED}


def test_cancellations_that_wait_for_the_server_are_limited(client: Client, caplog) -> None:
    dropped = "a cancellation for the action /fibonacci was dropped: too many are queued"
    for count, each in enumerate("abcd", 1):  # one after the other: all four would exceed the limit of two
        client.request_cancel(each)
        wait_until(lambda count=count: len(client.engine.log) == count, what="a call")  # type: ignore[misc]
    client.request_cancel(*"efefghi")
    wait_until(lambda: caplog.messages.count(dropped) == 3, what="the reasons")
    client.cancel.is_open.set()
    wait_until(lambda: client.engine.log.count("cancel_goal ?: answered") == 6, what="all answers")


class StuckClock(WallClock):
    """A clock whose first caller waits."""

    def __init__(self) -> None:
        super().__init__()
        self.is_used, self.is_free = threading.Event(), threading.Event()

    def now_ns(self) -> int:
        if not self.is_used.is_set():
            self.is_used.set()
            self.is_free.wait(60)
        return super().now_ns()


def test_goals_that_end_while_the_action_closes_get_a_result(client: Client, gateway: Node) -> None:
    client.send.is_open.set()
    client.start("first")
    client.wait_for("get_result first")
    clock = StuckClock()
    gateway.use_clock(clock)
    client.result.is_open.set()
    assert clock.is_used.wait(60)

    client.action.close()
    clock.is_free.set()

    wait_until(lambda: client.results, what="the result")
    assert client.results == {"first": Status.ABORTED}
