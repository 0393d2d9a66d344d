"""The goals of actions through a gateway, with an engine whose answers the test controls."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.limits import Limits
from pipros.libraries.actions.status import Status
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.ros2 import action_messages as messages
from pipros.ros2.action_messages import Ros2Status
from pipros.ros2.action_to_ros1 import ActionToRos1
from tests.support.ros2_gateways import PAIRS
from tests.support.waiting import wait_until

PAIR = PAIRS.of_action("actionlib_tutorials/Fibonacci")
GoalID: Any = load_message_class("actionlib_msgs/GoalID")
GoalStatus: Any = load_message_class("actionlib_msgs/GoalStatus")
Result: Any = load_message_class("actionlib_tutorials/FibonacciResult")
FEW = Limits(goals=2, ros2_history_bytes=150)


class Engine:
    """An engine that records what a gateway offers in ROS 2."""

    def __init__(self) -> None:
        self.services: dict[str, Callable[[bytes], bytes]] = {}

    def announce(self, *_: object) -> Engine:
        return self

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
def gateway(master_uri: str) -> Iterator[Node]:
    with Node("gateway", environment=Environment(master_uri=master_uri), limits=FEW) as node:
        yield node


def test_results_of_replaced_goals_do_not_count_towards_the_limit(node: Node, gateway: Node) -> None:
    engine: Any = Engine()
    action = ActionToRos1(gateway, engine, "/fibonacci", PAIR, "id")
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
