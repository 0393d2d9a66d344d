"""Extract parts of messages.

A part is selected by a path appended to the topic name: `/stamp`, `/ranges[1:3]`, `/status[:]/name`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pipros.basics.errors import NotFound, PiprosError
from pipros.msg.base import Message
from pipros.msg.language.spec import TIMES
from pipros.msg.time import TVal

_STEP = re.compile(r"(?P<name>[^\[\]]*)(?:\[(?P<index>[^\[\]]*)\])?")


class InvalidIndex(PiprosError, ValueError):
    """The text in brackets is neither a number nor a slice."""


class NotAnArray(NotFound):
    """A path has an index for a field that is not an array."""


@dataclass(frozen=True, slots=True)
class PathStep:
    """One field of a path, with an optional index.

    Attributes:
        text: the field and index as written, such as `ranges[0]`.
        name: the field name.
        index: an element or slice of the array; None for the whole field.
    """

    text: str
    name: str
    index: int | slice | None = None


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a message.

    Attributes:
        value: a message, a time, a plain value, or a list of these.
        type_name: the ROS type, such as `float32[]` or `std_msgs/Header`; None if unknown.
    """

    value: Any
    type_name: str | None


def parse_path(text: str) -> list[PathStep]:
    """Parse a path such as `/header/stamp` or `/ranges[0]` into steps.

    Raises:
        InvalidIndex: the brackets are malformed.
    """
    return [_parse_step(word) for word in text.split("/") if word]


def _parse_step(word: str) -> PathStep:
    match = _STEP.fullmatch(word)
    if match is None:
        raise InvalidIndex(f"field '{word}' has unbalanced brackets")
    name, written = match["name"], match["index"]
    if written is None:
        return PathStep(word, name)
    bounds = written.split(":")
    complaint = f"field '{name}' has invalid slice argument '{written}': "
    if len(bounds) > 3:
        raise InvalidIndex(complaint + "too many arguments for slice")
    if len(bounds) == 1:
        if not written:
            raise InvalidIndex(complaint + "empty array index")
        return PathStep(word, name, _integer(written, complaint + "non-integer array index step"))
    roles = ("start", "stop", "step")
    numbers = [
        _integer(bound, f"{complaint}non-integer slice {role}") if bound else None
        for role, bound in zip(roles, bounds, strict=False)
    ]
    return PathStep(word, name, slice(*numbers))


def _integer(text: str, complaint: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InvalidIndex(f"{complaint} '{text}'") from None


def describe_path(path: Sequence[PathStep]) -> str:
    """Format a path as it is appended to a topic name."""
    return "".join(f"/{step.text}" for step in path)


def extract(message: Message, path: Sequence[PathStep]) -> Part:
    """Return the part of a message that a path selects.

    If the path contains a slice, the part's value is a list, with None for each element of the slice that
    lacks the rest of the path.

    Raises:
        NotFound: the message lacks a field.
        NotAnArray: an indexed field is not an array.
        IndexError: an index is beyond the end of an array.
    """
    return _extract(Part(message, message._type), path)


def _extract(part: Part, path: Sequence[PathStep]) -> Part:
    if not path:
        return part
    step, rest = path[0], path[1:]
    field = _field(part, step.name)
    if step.index is None:
        return _extract(field, rest)
    if not hasattr(field.value, "__getitem__"):
        raise NotAnArray(f"field [{step.name}] of type [{field.type_name}] is not an array")
    if isinstance(step.index, int):
        return _extract(Part(field.value[step.index], _element_type(field.type_name)), rest)
    chosen = field.value[step.index]
    if not rest:
        return Part(chosen, field.type_name)
    parts = [_extract_or_none(Part(element, _element_type(field.type_name)), rest) for element in chosen]
    kind = next((part.type_name for part in parts if part.type_name is not None), None)
    return Part([part.value for part in parts], f"{kind}[]" if kind else None)


def _extract_or_none(part: Part, path: Sequence[PathStep]) -> Part:
    try:
        return _extract(part, path)
    except (NotFound, IndexError):
        return Part(None, None)


def _field(part: Part, name: str) -> Part:
    value = part.value
    if isinstance(value, TVal) and name in ("secs", "nsecs"):
        return Part(getattr(value, name), "int32")
    if isinstance(value, Message) and name in value.__slots__:
        slots = list(value.__slots__)
        return Part(getattr(value, name), value._slot_types[slots.index(name)])
    raise NotFound(f"no field named [{name}] in [{part.type_name}]")


def _element_type(type_name: str | None) -> str | None:
    return type_name.partition("[")[0] if type_name else None


def has_field(message_class: type[Message], path: Sequence[PathStep]) -> bool:
    """Return whether messages of a class have the field, assuming that their arrays are long enough."""
    type_name = message_class._type
    for step in path:
        fields = field_types(type_name, message_class)
        if step.name not in fields:
            return False
        type_name = fields[step.name]
        if step.index is not None:
            if not type_name.endswith("]") and type_name != "string":
                return False
            type_name = type_name.partition("[")[0]
    return True


def field_types(type_name: str, top: type[Message] | None = None) -> dict[str, str]:
    """Map a type's field names to their types. Types without fields, such as arrays, give an empty result."""
    if type_name in TIMES:
        return {"secs": "int32", "nsecs": "int32"}
    if top is not None and type_name == top._type:
        message_class: type[Message] | None = top
    elif "/" in type_name and not type_name.endswith("]"):
        from pipros.msg.class_finder import installed_class

        message_class = installed_class(type_name)
    else:
        message_class = None
    if message_class is None:
        return {}
    return dict(zip(message_class.__slots__, message_class._slot_types, strict=True))
