"""The engine for rclpy, without rclpy: its environment, queues and calls, and Pythons that cannot run it."""

import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from pipros.basics.errors import MissingExtra
from pipros.msg import load_message_class, load_service_class
from pipros_ros2 import to_ros1, to_ros2
from pipros_ros2.agent.engine import AgentCaller, AgentPublisher, AgentServer, RclpyEngine, cost_bytes
from pipros_ros2.agent.process import Frame, agent_environment, reaches_out
from pipros_ros2.agent.rclpy_agent import PENDING, Kind, RosEnd
from pipros_ros2.inbox import Inbox
from pipros_ros2.interface import Endpoint, EndpointKind, EngineError, Ros2CallFailed
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange
from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.interfaces.installed import folders_of_environment
from tests.support.waiting import wait_until

SWITCH = Endpoint(b"", EndpointKind.CLIENT, "/switch", "std_srvs/srv/SetBool")


class Engine:
    """Keeps the frames that endpoints send, and answers calls."""

    def __init__(self) -> None:
        self.process = self
        self.frames: list[Frame] = []
        self.available = 0
        self.answers: list[bytes | None] = []

    def send(self, kind: Kind, end: int, number: int = 0, body: bytes = b"") -> None:
        self.frames.append((kind, end, number, body))

    def send_later(self, make: Callable[[], Frame | None]) -> None:
        self.later = make

    def ask(self, kind: Kind, end: int, body: bytes, timeout_s: float) -> bytes | None:
        self.send(kind, end, 1, body)
        assert 0 < timeout_s < 60
        return self.answers.pop(0)

    def matches(self, own: Endpoint) -> int:
        assert own is SWITCH
        return self.available

    def close_end(self, number: int) -> None:
        self.send(Kind.CLOSE, number)


@pytest.fixture
def engine() -> Any:
    return Engine()


def test_the_agent_gets_only_folders_of_ros2_and_the_range_of_the_gateway() -> None:
    kept = {"AMENT_PREFIX_PATH": "/opt/ros/jazzy:/ws/install/own_msgs"}
    paths = "/catkin/devel/lib/python3/dist-packages:/opt/ros/jazzy/lib/python3.12/site-packages"
    dropped = {"PYTHONPATH": paths, "PIPROS_MESSAGES": "ros1", "ROS_LOCALHOST_ONLY": "1"}
    local, subnet = ({"ROS_AUTOMATIC_DISCOVERY_RANGE": each} for each in ("LOCALHOST", "SUBNET"))

    found = {"PYTHONPATH": "/opt/ros/jazzy/lib/python3.12/site-packages"}
    assert agent_environment(Discovery(), {**kept, **dropped}) == {**kept, **found, **local}
    away = Discovery(range=DiscoveryRange.SUBNET)
    assert agent_environment(away, {"PYTHONPATH": "/catkin"}) == subnet
    assert agent_environment(Discovery(), {"ROS_DISTRO": "humble"})["ROS_LOCALHOST_ONLY"] == "1"
    served = agent_environment(Discovery(), {"ROS_DISCOVERY_SERVER": "10.0.0.1:11811"})
    assert served["ROS_SUPER_CLIENT"] == "TRUE"


@pytest.mark.parametrize(("variables", "expected"), [
    ({}, False), ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, False),
    ({"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}, True), ({"ROS_DISCOVERY_SERVER": "127.0.0.1:11811"}, True),
    ({"CYCLONEDDS_URI": "file:///home/me/cyclone.xml"}, True),
    ({"FASTRTPS_DEFAULT_PROFILES_FILE": "/home/me/fast.xml"}, True),
])  # fmt: skip
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


def test_a_publisher_sends_a_message_when_the_pipe_has_room(engine: Any) -> None:
    publisher = AgentPublisher(engine, 7, SWITCH)

    publisher.publish(b"message")
    publisher.publish(b"another")

    for message in (b"message", b"another"):
        send, engine.later = engine.later, None
        assert send() == (Kind.PUBLISH, 7, 0, message)
    assert engine.later is None


def test_a_call_waits_for_a_server(engine: Any) -> None:
    engine.answers = [b"", b"", b"response"]

    assert AgentCaller(engine, 7, SWITCH).call(b"request", 60) == b"response"
    assert engine.frames == 3 * [(Kind.CALL, 7, 1, b"request")]


@pytest.mark.parametrize(
    ("available", "text"), [(0, "is not available"), (1, "did not answer within 0.01 s")]
)
def test_a_call_that_times_out_says_why(engine: Any, available: int, text: str) -> None:
    engine.available, engine.answers = available, [None]

    with pytest.raises(Ros2CallFailed, match=f"^the ROS 2 service /switch {text}$"):
        AgentCaller(engine, 7, SWITCH).call(b"", 0.01)


def test_a_service_that_fails_or_has_too_many_requests_sends_no_answer(engine: Any, caplog) -> None:
    over = threading.Event()

    def answer(request: bytes) -> bytes | None:
        over.wait(60)
        return {b"none": None, b"good": b"GOOD"}[request]

    server = AgentServer(engine, 7, SWITCH, answer)
    server.on_frame(1, b"bad")
    server.on_frame(2, b"none")
    for number in range(3, 70):
        server.on_frame(number, b"good")
    over.set()

    answers = [(Kind.ANSWER, 7, number, b"GOOD") for number in range(3, 65)]
    wait_until(lambda: sorted(engine.frames) == sorted(answers))
    assert server.dropped == 5
    assert caplog.messages == ["the service /switch for ROS 2 failed: b'bad'"]
    server.close()


def test_calls_that_never_get_a_response_are_forgotten() -> None:
    end = RosEnd(1, "client", None, None)
    for number in range(PENDING + 2):
        end.keep_pending(number, number)
    assert list(end.pending) == list(range(2, PENDING + 2))


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


# Conversion of message objects, with stand-ins for rclpy's classes and its serialization.


class _Generated(type):
    @classmethod
    def __import_type_support__(cls) -> None: ...


class Stand:
    """An object of rclpy that keeps its CDR."""

    def __init__(self, cdr: bytes = b"") -> None:
        self.cdr = cdr


def stand_in(module: str, name: str) -> Any:
    return _Generated(name, (Stand,), {"__module__": module})


@pytest.fixture
def rclpy(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("rclpy", "rclpy.serialization"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    serialization: Any = sys.modules["rclpy.serialization"]
    serialization.serialize_message = lambda message: message.cdr
    serialization.deserialize_message = lambda cdr, cls: cls(cdr)


def test_messages_are_converted_in_both_directions(rclpy: None, monkeypatch: pytest.MonkeyPatch) -> None:
    public = ModuleType("shape_msgs.msg")
    monkeypatch.setattr(public, "Plane", stand_in("shape_msgs.msg._plane", "Plane"), raising=False)
    ros1 = load_message_class("shape_msgs/Plane")
    monkeypatch.setitem(sys.modules, "shape_msgs.msg", public)
    monkeypatch.setattr("pipros_ros2.objects.load_message_class", {"shape_msgs/Plane": ros1}.get)
    there = to_ros2(ros1([1.0, 2.0, 3.0, 4.0]))
    assert type(there).__name__ == "Plane"
    assert to_ros1(there) == ros1([1.0, 2.0, 3.0, 4.0])


def test_parts_of_services_are_converted(rclpy: None, monkeypatch: pytest.MonkeyPatch) -> None:
    ros1 = load_service_class("std_srvs/SetBool")
    public: Any = ModuleType("std_srvs.srv")
    public.SetBool = stand_in("std_srvs.srv._set_bool", "SetBool")
    public.SetBool.Response = stand_in("std_srvs.srv._set_bool", "SetBool_Response")
    monkeypatch.setitem(sys.modules, "std_srvs.srv", public)
    monkeypatch.setattr("pipros_ros2.objects.load_service_class", {"std_srvs/SetBool": ros1}.get)
    assert to_ros1(to_ros2(ros1._response_class(True, "é"))) == ros1._response_class(True, "é")


def test_other_objects_are_refused(rclpy: None) -> None:
    with pytest.raises(TypeError, match=r"to_ros2\(\) needs a ROS 1 message, got str"):
        to_ros2("text")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"to_ros1\(\) needs a ROS 2 message, got int"):
        to_ros1(1)


def test_a_class_that_the_environment_lacks_is_named() -> None:
    with pytest.raises(ConversionError, match=r"no ROS 2 class nav_msgs\.msg\.Path"):
        to_ros2(load_message_class("nav_msgs/Path")())
    with pytest.raises(ConversionError, match="no type in ROS 1 corresponds to std_msgs/msg/Nothing"):
        to_ros1(stand_in("std_msgs.msg._nothing", "Nothing")())
    with pytest.raises(ConversionError, match=r"no ROS 2 class example_interfaces\.srv\.AddTwoInts"):
        to_ros2(load_service_class("roscpp_tutorials/TwoInts")._request_class(1, 2))


def test_without_rclpy_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(MissingExtra, match=r"needs rclpy, which is not installed.*\[jazzy\]"):
        to_ros1(stand_in("std_msgs.msg._string", "String")())


def test_folders_are_those_of_the_variable_and_of_wheels(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "share" / "ament_index" / "resource_index" / "packages").mkdir(parents=True)
    monkeypatch.syspath_prepend(tmp_path)
    found = folders_of_environment({"AMENT_PREFIX_PATH": "/opt/ros/jazzy"})
    assert found[:2] == [Path("/opt/ros/jazzy/share"), tmp_path / "share"]
