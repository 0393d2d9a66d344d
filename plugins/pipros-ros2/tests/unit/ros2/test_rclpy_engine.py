"""The engine for rclpy, without rclpy: its environment, queues and calls, and Pythons that cannot run it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from pipros_ros2.agent.endpoints import AgentCaller, AgentPublisher, AgentServer, cost_bytes
from pipros_ros2.agent.engine import RclpyEngine
from pipros_ros2.agent.process import agent_environment, reaches_out
from pipros_ros2.agent.rclpy_agent import HEADER, NUMBER, Kind
from pipros_ros2.inbox import Inbox
from pipros_ros2.interface import EngineError, Ros2CallFailed
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange
from tests.support.waiting import wait_until

SPEC = {"role": "client", "name": "/switch", "type": "std_srvs/srv/SetBool"}


class Connection:
    """Keeps the frames that endpoints send."""

    def __init__(self) -> None:
        self.frames: list[bytes] = []
        self.available = 0

    def send(self, kind: Kind, number: int, *parts: bytes) -> None:
        self.frames.append(b"".join((HEADER.pack(sum(map(len, parts)), kind, number), *parts)))

    def send_later(self, make: Callable[[], Sequence[bytes]]) -> None:
        self.later = make

    def matches(self, spec: Mapping[str, Any]) -> int:
        assert spec is SPEC
        return self.available

    def close_end(self, number: int) -> None:
        self.send(Kind.CLOSE, number)


def frame(kind: Kind, body: bytes) -> bytes:
    return HEADER.pack(len(body), kind, 7) + body


def test_the_agent_gets_only_folders_of_ros2_and_the_range_of_the_gateway() -> None:
    variables = {
        "AMENT_PREFIX_PATH": "/opt/ros/jazzy:/ws/install/own_msgs",
        "PYTHONPATH": "/catkin/devel/lib/python3/dist-packages:/opt/ros/jazzy/lib/python3.12/site-packages",
        "PIPROS_MESSAGES": "ros1",
        "ROS_LOCALHOST_ONLY": "1",
    }

    assert agent_environment(Discovery(), variables) == {
        "AMENT_PREFIX_PATH": "/opt/ros/jazzy:/ws/install/own_msgs",
        "PYTHONPATH": "/opt/ros/jazzy/lib/python3.12/site-packages",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    assert agent_environment(Discovery(range=DiscoveryRange.SUBNET), {"PYTHONPATH": "/catkin"}) == {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"
    }
    assert agent_environment(Discovery(), {"ROS_DISTRO": "humble"})["ROS_LOCALHOST_ONLY"] == "1"
    served = agent_environment(Discovery(), {"ROS_DISCOVERY_SERVER": "10.0.0.1:11811"})
    assert served["ROS_SUPER_CLIENT"] == "TRUE"


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({}, False),
        ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, False),
        ({"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}, True),
        ({"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"}, True),
        ({"CYCLONEDDS_URI": "file:///home/me/cyclone.xml"}, True),
        ({"FASTRTPS_DEFAULT_PROFILES_FILE": "/home/me/fast.xml"}, True),
    ],
)
def test_settings_that_may_reach_other_machines_require_an_allow_list(
    variables: dict[str, str], expected: bool
) -> None:
    assert reaches_out(Discovery(), variables) is expected
    assert reaches_out(Discovery(range=DiscoveryRange.SUBNET), variables)


def test_new_messages_replace_the_oldest_beyond_the_depth_and_the_size() -> None:
    inbox = Inbox(2, 10_000, cost_bytes)

    assert [inbox.push(each) for each in (b"1", b"2", b"3")] == [True, False, False]
    assert inbox.push(bytes(9_400)) is False
    assert (inbox.pop(), inbox.pop(), inbox.dropped) == (bytes(9_400), None, 3)
    assert inbox.push(b"4")


def test_a_publisher_sends_a_message_when_the_pipe_has_room() -> None:
    connection = Connection()
    publisher = AgentPublisher(connection, 7, {**SPEC, "role": "publisher"})

    publisher.publish(b"message")
    publisher.publish(b"another")

    for message in (b"message", b"another"):
        send, connection.later = connection.later, tuple
        assert b"".join(send()) == frame(Kind.PUBLISH, message)
    assert connection.later() == ()


def test_a_call_gets_its_reply_and_late_replies_are_ignored() -> None:
    connection = Connection()
    caller = AgentCaller(connection, 7, SPEC)
    send = connection.send

    def answer(kind: Kind, number: int, *parts: bytes) -> None:
        send(kind, number, *parts)
        caller.on_frame(NUMBER.pack(99) + b"of another call")
        caller.on_frame(parts[0] + b"reply")

    connection.send = answer  # type: ignore[method-assign]
    assert caller.call(b"request", 60) == b"reply"
    assert connection.frames == [frame(Kind.CALL, NUMBER.pack(1) + b"request")]


@pytest.mark.parametrize(
    ("available", "text"), [(0, "is not available"), (1, "did not answer within 0.01 s")]
)
def test_a_call_that_times_out_is_not_sent_later(available: int, text: str) -> None:
    connection = Connection()
    connection.available = available

    with pytest.raises(Ros2CallFailed, match=text):
        AgentCaller(connection, 7, SPEC).call(b"", 0.01)
    assert connection.frames[1:] == [frame(Kind.FORGET, NUMBER.pack(1))]


def test_a_failed_service_sends_an_empty_answer() -> None:
    def fail(_: bytes) -> bytes:
        raise ValueError("no")

    connection = Connection()
    server = AgentServer(connection, 7, {**SPEC, "role": "service"}, fail)
    server.on_frame(NUMBER.pack(3) + b"request")

    wait_until(lambda: connection.frames == [frame(Kind.ANSWER, NUMBER.pack(3))])
    server.close()


def test_a_python_without_rclpy_is_one_line(tmp_path: Path) -> None:
    absent = tmp_path / "python"
    isolated = tmp_path / "isolated"
    isolated.write_text(f'#!/bin/sh\nexec {sys.executable} -I -S "$@"\n')
    isolated.chmod(0o755)
    reasons = {
        absent: f"rclpy of [{absent}] failed: No such file or directory",
        isolated: f"[{isolated}] has no rclpy: name the Python of a ROS 2 environment with --ros2-python",
        Path("/bin/true"): "rclpy of [/bin/true] failed: the process of rclpy ended with exit code 0",
    }

    for python, reason in reasons.items():
        with pytest.raises(EngineError) as caught:
            RclpyEngine(Discovery(), "/gateway", str(python))
        assert str(caught.value) == reason
