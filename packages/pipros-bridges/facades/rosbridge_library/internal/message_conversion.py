"""Convert messages to JSON values, and back."""

from __future__ import annotations

from typing import Any

import rospy
from pipros.msg.base import Message
from pipros_bridges.rosbridge.filling import Filler, UnknownField, WrongValue
from pipros_bridges.rosbridge.plain_values import Format, PlainValues

_TO_JSON = PlainValues(Format.JSON_NULLS)


class InvalidMessageException(Exception):
    """The value is not a message."""

    def __init__(self, inst: Any) -> None:
        super().__init__(f"expected a message, got {type(inst).__name__}")


class NonexistentFieldException(Exception):
    """A value has a field that its message type lacks."""

    def __init__(self, basetype: str, fields: list[str]) -> None:
        super().__init__(f"[{basetype}] has no field {'.'.join(fields)}")


class FieldTypeMismatchException(Exception):
    """A value does not fit the type of its field."""

    def __init__(self, roottype: str, fields: list[str], expected_type: str, found_type: Any) -> None:
        super().__init__(f"field {'.'.join(fields)} of [{roottype}] must be {expected_type}: {found_type}")


def extract_values(inst: Any) -> dict[str, Any]:
    """Return the fields of a message as JSON values.

    Raises:
        InvalidMessageException: `inst` is not a message.
    """
    if not isinstance(inst, Message):
        raise InvalidMessageException(inst)
    return _TO_JSON.of(inst)


def populate_instance(msg: Any, inst: Any) -> Any:
    """Set the fields of a message from JSON values, and return the message.

    Raises:
        NonexistentFieldException: the message lacks one of the fields.
        FieldTypeMismatchException: a value does not fit its field.
    """
    try:
        Filler(lambda: rospy.get_rostime().to_nsec()).fill(inst, msg)
    except UnknownField as error:
        raise NonexistentFieldException(inst._type, error.path) from None
    except WrongValue as error:
        raise FieldTypeMismatchException(inst._type, error.path, error.expected, error.reason) from None
    return inst
