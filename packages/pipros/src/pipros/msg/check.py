"""Find the message field whose value does not fit its type, and raise an error with genpy's text.

These functions are called for messages from command lines, and after serializing a message has failed, so
they do not need to be fast.
"""

from __future__ import annotations

import struct
from typing import Any

from pipros.msg.errors import SerializationError
from pipros.msg.fields import HasFields, is_message
from pipros.msg.language.spec import FLOATS, INTEGERS, OCTETS
from pipros.msg.time import Duration, Time

_HEADERS = ("std_msgs/Header", "roslib/Header")
_NUMPY_NUMBERS = frozenset((*FLOATS, *INTEGERS)) - {"byte", "char"}


def check_type(field_name: str, field_type: str, field_val: Any) -> None:
    """Check that `field_val` fits `field_type`, a type as written in definitions.

    Raises:
        SerializationError: the value does not fit. The error text names the field, with `[]` for an element
            and `.` for a member.
    """
    _check(field_name, field_type, field_val, is_utf8=False)


def check_values(message: HasFields) -> None:
    """Check that a message can be written. Unlike genpy's `_check_types`, accept all text that is UTF-8.

    Raises:
        SerializationError: a value does not fit its field.
    """
    for slot, slot_type in zip(message.__slots__, message._get_types(), strict=True):
        _check(slot, slot_type, getattr(message, slot), is_utf8=True)


def _check(field_name: str, field_type: str, field_val: Any, *, is_utf8: bool) -> None:
    if field_type in INTEGERS:
        _check_integer(field_name, field_type, field_val)
    elif field_type in FLOATS:
        if type(field_val) not in (float, int) and not _is_numpy_number(field_val):
            raise SerializationError(f"field {field_name} must be float type")
    elif field_type == "bool":
        if field_val not in (True, False):
            raise SerializationError(f"field {field_name} is not a bool")
    elif field_type == "string":
        _check_string(field_name, field_val, is_utf8=is_utf8)
    elif field_type == "time":
        if not isinstance(field_val, Time):
            raise SerializationError(f"field {field_name} must be of type Time")
    elif field_type == "duration":
        if not isinstance(field_val, Duration):
            raise SerializationError(f"field {field_name} must be of type Duration")
    elif field_type.endswith("]"):
        _check_array(field_name, field_type.partition("[")[0], field_val, is_utf8=is_utf8)
    else:
        _check_message(field_name, field_type, field_val, is_utf8=is_utf8)


def check_lengths(name: str, message: HasFields) -> None:
    """Check the lengths of all fixed arrays, including those in embedded messages.

    Raises:
        SerializationError: an array has the wrong length. The error text names the field, prefixed by `name`.
    """
    for slot, slot_type in zip(message.__slots__, message._get_types(), strict=True):
        value, path = getattr(message, slot), f"{name}.{slot}"
        digits = slot_type.partition("[")[2].rstrip("]")
        if digits and len(value) != (length := int(digits)):
            raise SerializationError(f"Expecting {length} items but found {len(value)} when writing '{path}'")
        for element in value if isinstance(value, list | tuple) else (value,):
            if is_message(element):
                check_lengths(path, element)


def _check_integer(name: str, type_name: str, value: Any) -> None:
    code = INTEGERS[type_name]
    is_signed = code.islower()
    if is_signed and type(value) is not int:
        raise SerializationError(f"field {name} must be an integer type")
    if not is_signed and (type(value) is not int or value < 0):
        raise SerializationError(f"field {name} must be unsigned integer type")
    bits = 8 * struct.calcsize(f"<{code}")
    low, high = (-(1 << bits - 1), 1 << bits - 1) if is_signed else (0, 1 << bits)
    if not low <= value < high:
        raise SerializationError(f"field {name} exceeds specified width [{type_name}]")


def _check_string(name: str, value: Any, *, is_utf8: bool) -> None:
    if type(value) is str:
        try:
            value.encode("utf-8" if is_utf8 else "ascii")
        except UnicodeEncodeError:
            kind = "is not UTF-8" if is_utf8 else "is a non-ascii string"
            raise SerializationError(f"field {name} {kind}") from None
    elif type(value) is not bytes:
        raise SerializationError(f"field {name} must be of type bytes or an ascii string")


def _check_array(name: str, base: str, value: Any, *, is_utf8: bool) -> None:
    if type(value) in (bytes, str):
        if base not in OCTETS:
            raise SerializationError(
                f"field {name} must be a list or tuple type. Only uint8[] can be a string"
            )
        return
    if type(value) not in (list, tuple):
        raise SerializationError(f"field {name} must be a list or tuple type")
    for element in value:
        _check(f"{name}[]", base, element, is_utf8=is_utf8)


def _check_message(name: str, type_name: str, value: Any, *, is_utf8: bool) -> None:
    if not is_message(value):
        raise SerializationError(f"field {name} must be of type [{type_name}]")
    if value._type in _HEADERS:
        if type_name not in ("Header", *_HEADERS):
            # genpy's text, although the value is the header
            raise SerializationError(f"field {name} must be a Header instead of a {value._type}")
    elif value._type != type_name:
        raise SerializationError(f"field {name} must be of type {type_name} instead of {value._type}")
    for slot, slot_type in zip(value.__slots__, value._get_types(), strict=True):
        _check(f"{name}.{slot}", slot_type, getattr(value, slot), is_utf8=is_utf8)


def _is_numpy_number(value: Any) -> bool:
    return type(value).__module__ == "numpy" and type(value).__name__ in _NUMPY_NUMBERS
