"""Derive ROS 2 definitions from ROS 1 types whose fields have not changed."""

from __future__ import annotations

import re

from pipros.msg.language.spec import HEADER, MessageSpec, ServiceSpec
from pipros_rosbag2.interfaces.action_types import Ros2Action
from pipros_rosbag2.interfaces.spec import (
    DURATION,
    NO_FIELDS,
    PRIMITIVES,
    TIME,
    Form,
    Ros2Constant,
    Ros2Field,
    Ros2Message,
    Ros2Service,
    Ros2Type,
)

_TIMES = {"time": TIME, "duration": DURATION}
_LOST = (HEADER, "seq")
"""A type, and the field that ROS 2 has removed from it."""


def derived_message(spec: MessageSpec, type_name: str = "") -> Ros2Message:
    """Return the ROS 2 definition for a ROS 1 definition.

    Args:
        type_name: the name in ROS 2; by default `package/msg/Name`.
    """
    fields = tuple(
        Ros2Field(_type(each.type.base, each.type.is_array, each.type.length), member_name(each.name))
        for each in spec.fields
        if (spec.type, each.name) != _LOST and each.type.length != 0
    )
    constants = tuple(
        Ros2Constant(each.type, member_name(each.name).upper(), _text(each.value)) for each in spec.constants
    )
    return Ros2Message(type_name or type_name_of(spec.type), fields or (NO_FIELDS,), constants, spec.file)


def derived_service(spec: ServiceSpec) -> Ros2Service:
    """Return the ROS 2 definition for a ROS 1 service."""
    name = type_name_of(spec.type, "srv")
    return Ros2Service(
        name,
        derived_message(spec.request, f"{name}_Request"),
        derived_message(spec.response, f"{name}_Response"),
    )


def derived_action(goal: MessageSpec, result: MessageSpec, feedback: MessageSpec) -> Ros2Action:
    """Return the ROS 2 definition for the parts of a ROS 1 action."""
    name = type_name_of(goal.type.removesuffix("Goal"), "action")
    return Ros2Action(
        name,
        derived_message(goal, f"{name}_Goal"),
        derived_message(result, f"{name}_Result"),
        derived_message(feedback, f"{name}_Feedback"),
    )


def type_name_of(ros1: str, middle: str = "msg") -> str:
    """Return the name of a type in ROS 2, where packages are lower case and types are in camel case.

    >>> type_name_of("Demo/my_status")
    'demo/msg/MyStatus'
    """
    package, _, name = ros1.partition("/")
    camel = "".join(part[:1].upper() + part[1:] for part in name.split("_"))
    return f"{member_name(package)}/{middle}/{camel}"


def member_name(name: str) -> str:
    """Return a name that ROS 2 allows: lower case, without double or final underscores.

    >>> member_name("Left__Wheel_")
    'left_wheel'
    """
    return re.sub("_+", "_", name.lower()).rstrip("_")


def changes(spec: MessageSpec) -> list[str]:
    """Return what the ROS 2 definition of a message has changed, one line for each field or constant."""
    lines = []
    for field in spec.fields:
        base = field.type.base
        new = [_TIMES[base].replace("/msg/", "/")] if base in _TIMES else []
        new += ["std_msgs/Header without seq"] if base == HEADER else []
        new += [member_name(field.name)] if member_name(field.name) != field.name else []
        if field.type.length == 0:
            new = ["nothing, because ROS 2 has no arrays of length 0"]
        if new:
            lines.append(f"{spec.type}: {field.type} {field.name} becomes {', '.join(new)}")
    for constant in spec.constants:
        if member_name(constant.name).upper() != constant.name:
            lines.append(f"{spec.type}: {constant.name} becomes {member_name(constant.name).upper()}")
    return lines


def _type(base: str, is_array: bool, length: int | None) -> Ros2Type:
    form = Form.SINGLE if not is_array else Form.SEQUENCE if length is None else Form.ARRAY
    name = base if base in PRIMITIVES else _TIMES.get(base) or type_name_of(base)
    return Ros2Type(name, form, length or 0)


def _text(value: bool | int | float | str) -> str:
    if isinstance(value, str):
        quoted = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{quoted}"'
    return str(value).lower() if isinstance(value, bool) else str(value)
