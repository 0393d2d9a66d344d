"""The names that code made by `compiler.py` uses; no definition can have any of them.

Nothing else imports this module.
"""

from __future__ import annotations

import struct as _struct

from pipros.msg.base import Buffer
from pipros.msg.base import Message as _Message
from pipros.msg.compile.arrays import numbers as _numbers
from pipros.msg.compile.arrays import numpy_numbers as _numpy_numbers
from pipros.msg.compile.arrays import octets as _octets
from pipros.msg.compile.compiled import CompiledMessage as _CompiledMessage
from pipros.msg.compile.compiled import read_specially, special_reader
from pipros.msg.compile.string_arrays import TOO_SHORT as _TOO_SHORT
from pipros.msg.compile.string_arrays import RepeatedStrings as _RepeatedStrings
from pipros.msg.compile.string_arrays import read_strings as _read_strings
from pipros.msg.errors import DeserializationError as _DeserializationError
from pipros.msg.errors import SerializationError
from pipros.msg.time import Duration as _Duration
from pipros.msg.time import Time as _Time

TYPE_CHECKING = False  # true for type checkers; importing `typing` would double the time of a first import
if TYPE_CHECKING:
    from typing import Any, NoReturn

__all__ = [
    "_TOO_SHORT",
    "_WRITE_ERRORS",
    "_CompiledMessage",
    "_DeserializationError",
    "_Duration",
    "_Message",
    "_RepeatedStrings",
    "_Time",
    "_UnicodeDecodeError",
    "_ValueError",
    "_bytes",
    "_fixed_octets",
    "_len",
    "_list",
    "_new",
    "_numbers",
    "_numpy_numbers",
    "_octets",
    "_raise_write_error",
    "_range",
    "_read_strings",
    "_reread_leniently",
    "_room",
    "_room_left",
    "_str",
    "_struct",
]

# The generated class is in the same namespace, and a definition may be called Message, or len.
_bytes, _len, _list, _range, _str = bytes, len, list, range, str
_UnicodeDecodeError, _ValueError = UnicodeDecodeError, ValueError
_new = object.__new__

_WRITE_ERRORS = (_struct.error, TypeError, ValueError, OverflowError, AttributeError)
"""What writing a message raises if a field has a value of the wrong kind."""


def _raise_write_error(message: _Message, error: Exception) -> NoReturn:
    """Explains why `message` could not be written.

    Raises:
        SerializationError: always.
    """
    from pipros.msg.check import check_lengths

    message._check_types()
    check_lengths("self", message)
    raise SerializationError(f"{type(error)}: '{error}' when writing '{message}'")


def _reread_leniently(message: Any, data: Buffer, error: UnicodeDecodeError) -> Any:
    """Reads a message with replacements for bytes that are not UTF-8; logs it once for each type."""
    cls = type(message)
    if "_lenient_reader" not in vars(cls):
        import logging

        cls._lenient_reader = special_reader(cls, is_numpy=False)
        logging.getLogger("rosout").error(
            "Characters replaced when decoding message %s (will print only once): %s", cls._type, error
        )
    return read_specially(cls._lenient_reader, message, data, None)


def _fixed_octets(value: Any, length: int) -> bytes:
    """The value of a `uint8[n]` or `char[n]` field. `bytes` are cut or padded, as in genpy."""
    if value.__class__ is bytes:
        return value
    octets = bytes(_octets(value))
    if len(octets) != length:
        raise ValueError(f"the array must have {length} elements, got {len(octets)}")
    return octets


def _room(values: int) -> int:
    """How many values beyond those that its bytes pay for a message may still hold; it has `values` anyway.

    Raises:
        struct.error: when those are too many already.
    """
    from pipros.limits import process_limits

    return _room_left(process_limits().empty_elements, values)


def _room_left(room: int, values: int) -> int:
    """`room` without `values`. Raises as `_room`."""
    if values > room:
        raise _struct.error(
            f"it holds {values - room} values too many in elements that take few bytes or none"
        )
    return room - values
