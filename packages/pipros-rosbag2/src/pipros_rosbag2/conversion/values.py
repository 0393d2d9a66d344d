"""A common representation of ROS 1 and ROS 2 field types, used for serialization."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum

from pipros.msg.language.digest import Lookup
from pipros.msg.language.spec import FLOATS, NUMBERS, FieldType, MessageSpec
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.spec import DURATION, SIZES, TIME, Form, Ros2Message, Ros2Type


class ValueKind(Enum):
    """Kind of value. The enum values appear in error messages."""

    INTEGER = "integers"
    FLOAT = "floating-point numbers"
    STRING = "strings"
    WIDE_STRING = "wide strings"
    TIME = "times"
    DURATION = "durations"
    MESSAGE = "messages"


@dataclass(frozen=True, slots=True)
class Value:
    """The type of a field.

    Attributes:
        length: number of elements of an array.
        size: size in bytes of one number or time.
        message: the definition of an embedded message.
        bound: maximum number of elements; 0 for no maximum.
        string_bound: maximum number of characters; 0 for no maximum.
        default: the default as written in a ROS 2 definition, or empty.
    """

    kind: ValueKind
    form: Form = Form.SINGLE
    length: int = 0
    size: int = 0
    message: MessageSpec | Ros2Message | None = None
    bound: int = 0
    string_bound: int = 0
    default: str = ""

    @property
    def alignment(self) -> int:
        """CDR alignment of one number or time."""
        return 4 if self.kind in (ValueKind.TIME, ValueKind.DURATION) else self.size


WHOLE_MESSAGES = {
    "std_msgs/Time": ValueKind.TIME,
    "std_msgs/Duration": ValueKind.DURATION,
    TIME: ValueKind.TIME,
    DURATION: ValueKind.DURATION,
}
"""Messages that contain a single time or duration, which may have a built-in type on the other side."""


class Values:
    """Converter from field types to `Value`."""

    def __init__(self, lookup: Lookup, catalog: Catalog) -> None:
        self._lookup = lookup
        self._catalog = catalog

    def of_message(self, message: MessageSpec | Ros2Message) -> Value:
        """Return the `Value` for an entire message."""
        kind = WHOLE_MESSAGES.get(message.type, ValueKind.MESSAGE)
        return Value(kind, size=0 if kind is ValueKind.MESSAGE else 8, message=message)

    def of_fields(self, message: MessageSpec | Ros2Message) -> dict[str, Value]:
        """Return the `Value` of each field of a message, by name and in order."""
        if isinstance(message, MessageSpec):
            return {each.name: self._ros1(each.type) for each in message.fields}
        return {each.name: self._ros2(each.type, each.default) for each in message.fields}

    def _ros1(self, kind: FieldType) -> Value:
        form = Form.SINGLE if not kind.is_array else Form.SEQUENCE if kind.length is None else Form.ARRAY
        length = kind.length or 0
        base = kind.base
        if base in NUMBERS:
            number = ValueKind.FLOAT if base in FLOATS else ValueKind.INTEGER
            return Value(number, form, length, struct.calcsize(f"<{NUMBERS[base]}"))
        if base == "string":
            return Value(ValueKind.STRING, form, length)
        if kind.is_builtin:
            return Value(ValueKind.TIME if base == "time" else ValueKind.DURATION, form, length, 8)
        whole = WHOLE_MESSAGES.get(base, ValueKind.MESSAGE)
        return Value(whole, form, length, 0 if whole is ValueKind.MESSAGE else 8, self._lookup(base))

    def _ros2(self, kind: Ros2Type, default: str) -> Value:
        length = kind.length if kind.form is Form.ARRAY else 0
        bound = kind.length if kind.form is Form.BOUNDED else 0
        form = Form.SEQUENCE if kind.form is Form.BOUNDED else kind.form
        base = kind.base
        if base in SIZES:
            number = ValueKind.FLOAT if base.startswith("float") else ValueKind.INTEGER
            return Value(number, form, length, SIZES[base], bound=bound, default=default)
        if base in ("string", "wstring"):
            text = ValueKind.STRING if base == "string" else ValueKind.WIDE_STRING
            return Value(text, form, length, 0, None, bound, kind.string_bound, default)
        whole = WHOLE_MESSAGES.get(base, ValueKind.MESSAGE)
        message = self._catalog.message(base)
        return Value(whole, form, length, 0 if whole is ValueKind.MESSAGE else 8, message, bound)
