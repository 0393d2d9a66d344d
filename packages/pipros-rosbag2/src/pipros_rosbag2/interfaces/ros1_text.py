"""Derive ROS 1 definitions for types that exist only in ROS 2."""

from __future__ import annotations

import re

from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import DefinitionError, MessageSpec
from pipros_rosbag2.interfaces.spec import DURATION, HEADER, NO_FIELDS, TIME, Form, Ros2Constant, Ros2Message

_NAMES = {TIME: "time", DURATION: "duration"}


def ros1_name(name: str) -> str:
    """Return `package/Name` for `package/msg/Name`, or for `srv` or `action` in place of `msg`."""
    return re.sub("/(msg|srv|action)/", "/", name)


def ros1_definition(message: Ros2Message) -> MessageSpec:
    """Return the definition in the ROS 1 language. Bounds and default values are lost.

    Raises:
        DefinitionError: the type has a field that ROS 1 cannot express.
    """
    lines = [_constant(each) for each in message.constants]
    for field in message.fields:
        kind = field.type
        if field == NO_FIELDS:
            continue
        if kind.base == "wstring":
            raise DefinitionError(f"ROS 1 has no wide strings: {field.name}", file=message.file)
        is_header = kind.base == HEADER and kind.form is Form.SINGLE
        base = "Header" if is_header else _NAMES.get(kind.base) or ros1_name(kind.base)
        suffix = {Form.SINGLE: "", Form.ARRAY: f"[{kind.length}]"}.get(kind.form, "[]")
        lines.append(f"{base}{suffix} {field.name}")
    return parse_message("".join(f"{line}\n" for line in lines), ros1_name(message.type), message.file)


def _constant(constant: Ros2Constant) -> str:
    kind, text = constant.type.partition("<")[0], constant.text
    if kind == "string":
        text = text[1:-1] if text[:1] in ("'", '"') and text[-1:] == text[:1] else text
    elif kind == "bool":
        text = str(text.lower() in ("true", "1"))
    elif "x" in text.lower():
        text = str(int(text, 0))
    return f"{kind} {constant.name}={text}"
