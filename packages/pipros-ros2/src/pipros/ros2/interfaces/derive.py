"""Derive ROS 2 definitions from ROS 1 types whose fields have not changed."""

from __future__ import annotations

from pipros.msg.language.spec import HEADER, MessageSpec, ServiceSpec
from pipros.ros2.interfaces.parse import full_name
from pipros.ros2.interfaces.spec import (
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
        Ros2Field(_type(each.type.base, each.type.is_array, each.type.length), each.name)
        for each in spec.fields
        if (spec.type, each.name) != _LOST and each.type.length != 0
    )
    constants = tuple(Ros2Constant(each.type, each.name, _text(each.value)) for each in spec.constants)
    return Ros2Message(type_name or full_name(spec.type), fields or (NO_FIELDS,), constants, spec.file)


def derived_service(spec: ServiceSpec) -> Ros2Service:
    """Return the ROS 2 definition for a ROS 1 service."""
    name = spec.type.replace("/", "/srv/")
    return Ros2Service(
        name,
        derived_message(spec.request, f"{name}_Request"),
        derived_message(spec.response, f"{name}_Response"),
    )


def _type(base: str, is_array: bool, length: int | None) -> Ros2Type:
    form = Form.SINGLE if not is_array else Form.SEQUENCE if length is None else Form.ARRAY
    name = base if base in PRIMITIVES else _TIMES.get(base) or full_name(base)
    return Ros2Type(name, form, length or 0)


def _text(value: bool | int | float | str) -> str:
    if isinstance(value, str):
        quoted = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{quoted}"'
    return str(value).lower() if isinstance(value, bool) else str(value)
