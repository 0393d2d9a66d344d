"""Conversion between the message objects of rospy and rclpy, in an environment that contains both.

    from pipros.ros1.std_msgs.msg import String
    from pipros_ros2 import to_ros1, to_ros2

    rclpy_publisher.publish(to_ros2(String("hello")))

Types correspond as in the gateway, without mapping files. The definitions are those of the environment.
"""

from __future__ import annotations

import io
import os
import threading
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

from pipros.basics.extras import missing
from pipros.msg import load_message_class, load_service_class
from pipros.msg.base import Message
from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES
from pipros_rosbag2.conversion.plans import ConversionPlan, Plans
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.installed import folders_of_environment, installed_definitions

_PARTS = ("Request", "Response")
_lock = threading.Lock()


class _Route(NamedTuple):
    plan: ConversionPlan
    target: Any  # the class of the results


def to_ros2(message: Message) -> Any:
    """Return the rclpy object for a rospy message, or for the request or response of a service.

    Fields that ROS 2 lacks, such as `Header.seq`, are dropped.

    Raises:
        ConversionError: ROS 2 has no such type, its fields differ, or its package is not installed.
        TypeError: `message` is not a ROS 1 message.
    """
    if not isinstance(message, Message):
        raise TypeError(f"to_ros2() needs a ROS 1 message, got {type(message).__name__}")
    cls: Any = type(message)
    with _lock:
        plan, target = _from_ros1(cls)
    data = io.BytesIO()
    message.serialize(data)
    return _serialization().deserialize_message(plan.to_cdr(data.getbuffer()), target)


def to_ros1(message: Any) -> Message:
    """Return the rospy message for an rclpy object. Raises the same errors as `to_ros2`."""
    if isinstance(message, type) or not hasattr(type(message), "__import_type_support__"):
        raise TypeError(f"to_ros1() needs a ROS 2 message, got {type(message).__name__}")
    cls: Any = type(message)
    with _lock:
        plan, target = _from_ros2(cls)
    result: Message = target().deserialize(plan.to_ros1(_serialization().serialize_message(message)))
    return result


def _serialization() -> Any:
    try:
        return import_module("rclpy.serialization")
    except ModuleNotFoundError as error:
        raise missing("conversion to messages of ROS 2 needs rclpy", "pipros-ros2[jazzy]", error) from None


@cache
def _plans() -> Plans:
    ros1 = installed_definitions()
    return Plans(Catalog(Distribution.JAZZY, ros1, folders_of_environment(os.environ)), ros1, BUILTIN_RULES)


@cache
def _from_ros1(cls: type[Message]) -> _Route:
    part = _part(cls, ".srv.")
    if not part:
        plan = _plans().for_ros1(cls._type)
        package, _, name = plan.ros2_type.split("/")
        return _Route(plan, _rclpy_class(f"{package}.msg", name))
    service = _plans().service(cls._type.removesuffix(part))
    package, _, name = service.ros2_type.split("/")
    both = _rclpy_class(f"{package}.srv", name)
    return _Route(getattr(service, part.lower()), getattr(both, part))


@cache
def _from_ros2(cls: type) -> _Route:
    package, kind, *_ = cls.__module__.split(".")
    part = _part(cls, ".srv.")
    if not part:
        plan = _plans().for_ros2(f"{package}/{kind}/{cls.__name__}")
        return _Route(plan, load_message_class(plan.ros1_type))
    name = cls.__name__.removesuffix(f"_{part}")
    service = _plans().service(_plans().ros1_service(f"{package}/srv/{name}"))
    both: Any = load_service_class(service.ros1_type)
    return _Route(getattr(service, part.lower()), getattr(both, f"_{part.lower()}_class"))


def _part(cls: type, kind: str) -> str:
    """Return `Request` or `Response` for a part of a service, and an empty string for a message."""
    return next((part for part in _PARTS if kind in cls.__module__ and cls.__name__.endswith(part)), "")


def _rclpy_class(module: str, name: str) -> Any:
    try:
        found = getattr(import_module(module), name, None)
    except ModuleNotFoundError:
        found = None
    if not hasattr(found, "__import_type_support__"):
        raise ConversionError(
            f"this environment has no ROS 2 class {module}.{name}; install its package, and unset "
            "PIPROS_MESSAGES"
        )
    return found
