"""ROS 2 interface definitions as plain values.

Type names have three parts (`std_msgs/msg/Header`), even if a file uses a short form.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from pipros.msg.language.spec import NUMBERS

SIZES = {name: struct.calcsize(f"<{code}") for name, code in NUMBERS.items()}
"""Numeric types, with their size in bytes in CDR, which is also their alignment."""

PRIMITIVES = frozenset((*SIZES, "string", "wstring"))

TIME = "builtin_interfaces/msg/Time"
DURATION = "builtin_interfaces/msg/Duration"
HEADER = "std_msgs/msg/Header"


class Form(Enum):
    """Form of a field: a single value, a fixed array, a bounded sequence or an unbounded sequence."""

    SINGLE = "single"
    ARRAY = "array"
    BOUNDED = "bounded"
    SEQUENCE = "sequence"


@dataclass(frozen=True, slots=True)
class Ros2Type:
    """The type of a field.

    Attributes:
        base: a primitive type, or the name of a message.
        length: the number of elements of an array, or the maximum length of a bounded sequence.
        string_bound: maximum number of characters of a `string<=N`; 0 for no maximum.
    """

    base: str
    form: Form = Form.SINGLE
    length: int = 0
    string_bound: int = 0

    @property
    def is_primitive(self) -> bool:
        return self.base in PRIMITIVES

    def __str__(self) -> str:
        """Return the type as written in definitions, with two-part message names."""
        base = self.base.replace("/msg/", "/") + (f"<={self.string_bound}" if self.string_bound else "")
        return (
            base
            + {
                Form.SINGLE: "",
                Form.ARRAY: f"[{self.length}]",
                Form.BOUNDED: f"[<={self.length}]",
                Form.SEQUENCE: "[]",
            }[self.form]
        )


@dataclass(frozen=True, slots=True)
class Ros2Field:
    """A field, defined by a line `type name default`. `default` is the text as written, or empty."""

    type: Ros2Type
    name: str
    default: str = ""


@dataclass(frozen=True, slots=True)
class Ros2Constant:
    """A constant, defined by a line `type NAME=value`. `text` is the value as written."""

    type: str
    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Ros2Message:
    """A message definition, or a part of a service or an action.

    Attributes:
        type: `package/msg/Name`.
        fields: at least one; an empty definition has the single field `NO_FIELDS`.
        file: the source, for error messages.
    """

    type: str
    fields: tuple[Ros2Field, ...]
    constants: tuple[Ros2Constant, ...] = ()
    file: str = ""

    def text(self) -> str:
        """Return the definition in the language of `.msg` files, without comments."""
        lines = [f"{each.type} {each.name}={each.text}" for each in self.constants]
        for field in self.fields:
            if field != NO_FIELDS:
                lines.append(f"{field.type} {field.name} {field.default}".rstrip())
        return "".join(f"{line}\n" for line in lines)


@dataclass(frozen=True, slots=True)
class Ros2Service:
    """A service definition. Its parts have the types `package/srv/Name_Request` and `…_Response`."""

    type: str
    request: Ros2Message
    response: Ros2Message


NO_FIELDS = Ros2Field(Ros2Type("uint8"), "structure_needs_at_least_one_member")
"""The field of a definition without fields. It has one byte on the wire."""


@dataclass(frozen=True, slots=True)
class CompleteRos2Message:
    """A definition and the definitions of all embedded types, by name."""

    message: Ros2Message
    embedded: Mapping[str, Ros2Message]
