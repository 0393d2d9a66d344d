"""Genuine rospy nodes whose messages and goals pass a bridge, while other publishers come and go.

A bridge asks publishers for the definitions of their topics. Genuine rospy keeps one connection for each
caller ID: the questions must not end the bridge's subscription.
"""

import itertools
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros_libraries.actions.status import Status
from pipros_ros2.interface import EndpointKind, Sample, TopicQos
from tests.graph.test_ros2_actions import PAIR, Server
from tests.support import foxglove
from tests.support.environments import file_of_tests, genuine_environment
from tests.support.processes import Processes
from tests.support.ros2_domains import free_domain
from tests.support.ros2_gateways import PAIRS, System
from tests.support.waiting import wait_until

PYTHON = "/usr/bin/python3"
INT: Any = load_message_class("std_msgs/Int32")
INT32 = "std_msgs/msg/Int32"
GOALS = 40


class Rival:
    """Another publisher of a topic."""

    def __init__(self, system: System, number: int, topic: str, message_class: Any) -> None:
        """Publish the topic, then another one, `mark`, with which a bridge shows that it has seen both."""
        self.mark = f"/mark{number}"
        node = system.node(f"rival{number}")
        self.publisher = node.advertise(topic, message_class)
        node.advertise(self.mark, INT)


@pytest.fixture
def system() -> Iterator[System]:
    with free_domain() as domain:
        system = System(domain, has_zenoh=False)
        yield system
        system.close()


@pytest.fixture
def genuine(system: System, tmp_path: Path) -> Iterator[Processes]:
    processes = Processes(genuine_environment(tmp_path, system.master_uri), tmp_path)
    yield processes
    processes.end_all()


def gaps(numbers: list[int]) -> list[tuple[int, int]]:
    return [(a, b) for a, b in itertools.pairwise(numbers) if b != a + 1]


def test_a_gateway_loses_no_message_of_rospy_when_publishers_appear(
    system: System, genuine: Processes
) -> None:
    system.gateway()
    genuine.start(PYTHON, file_of_tests("interop/programs/send_numbers.py"), "talker", "std_msgs/Int32")
    wait_until(lambda: system.has(EndpointKind.PUBLISHER, "/numbers"), what="the topic in ROS 2")
    samples: list[Sample] = []
    all_samples = TopicQos(depth=0)  # with a depth of 10, a test that stalls for 0.1 s would lose some itself
    system.ros2.subscribe("/numbers", INT32, PAIRS.of_ros2(INT32).type_hash, all_samples, samples.append)
    wait_until(lambda: len(samples) > 50, what="messages")

    for number in range(8):
        rival = Rival(system, number, "/numbers", INT)
        wait_until(lambda mark=rival.mark: system.has(EndpointKind.PUBLISHER, mark), what="the mark in ROS 2")
        before = len(samples)
        wait_until(lambda count=before: len(samples) > count + 30, what="messages after the query")

    numbers = [struct.unpack_from("<i", each.payload, 4)[0] for each in samples]
    assert gaps(numbers) == []


def test_a_foxglove_server_loses_no_message_of_rospy_when_publishers_appear(
    system: System, genuine: Processes
) -> None:
    with foxglove.serving(system.node("server")) as address, foxglove.connected(address) as client:
        genuine.start(
            PYTHON, file_of_tests("interop/programs/send_numbers.py"), "talker", "kit_of_no_package/Number"
        )
        client.subscribe(1, "/numbers")
        numbers: list[int] = []

        def receive(count: int) -> None:
            for _ in range(count):
                numbers.append(struct.unpack("<i", client.next_message()[2])[0])

        receive(50)
        kind: Any = type("Number", (INT,), {"_type": "kit_of_no_package/Number"})
        for number in range(8):
            rival = Rival(system, number, "/numbers", kind)
            client.until(lambda mark=rival.mark: mark in client.channels)
            receive(30)

    assert gaps(numbers) == []


def test_goals_of_genuine_clients_reach_ros2_when_other_clients_appear(
    system: System, genuine: Processes, tmp_path: Path
) -> None:
    far = system.node("far", system.new_master())

    class Immediate(Server):
        def _on_goal(self, message: Any) -> None:
            self.end(message, Status.SUCCEEDED, [message.goal.order])

    Immediate(far)
    system.gateway("actions: {to_ros1: {allow: [/fibonacci]}}", master_uri=far.environment.master_uri)
    system.gateway()
    text = tmp_path / "fibonacci"
    text.write_text(load_message_class("actionlib_tutorials/FibonacciAction")._full_text)

    client = genuine.start(PYTHON, file_of_tests("interop/programs/send_many_goals.py"), text, str(GOALS))
    client.wait_for("server True", 60)
    number = 0
    while "succeeded" not in client.output:
        rival = Rival(system, number, "/fibonacci/goal", PAIR.goal)
        mark = rival.mark
        wait_until(
            lambda mark=mark: system.has(EndpointKind.PUBLISHER, mark) or "succeeded" in client.output,
            what="the mark in ROS 2",
        )
        rival.publisher.unregister()
        number += 1

    client.wait_for(f"succeeded {GOALS}")
