"""Conversion of message objects, with stand-ins for rclpy's classes and its serialization."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from pipros.basics.errors import MissingExtra
from pipros.msg import load_message_class, load_service_class
from pipros_ros2 import to_ros1, to_ros2
from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.interfaces.installed import folders_of_environment


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


def test_folders_are_those_of_the_variable_and_of_wheels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "share" / "ament_index" / "resource_index" / "packages").mkdir(parents=True)
    monkeypatch.syspath_prepend(tmp_path)
    found = folders_of_environment({"AMENT_PREFIX_PATH": "/opt/ros/jazzy"})
    assert found[:2] == [Path("/opt/ros/jazzy/share"), tmp_path / "share"]
