"""What the source made by `compiler.py` calls by name, names that no definition can have.

Nothing else imports this module.
"""

from __future__ import annotations

import struct as _struct

from pipros.msg.arrays import numbers as _numbers
from pipros.msg.arrays import numpy_numbers as _numpy_numbers
from pipros.msg.arrays import octets as _octets
from pipros.msg.base import Buffer, SerializationError, read_specially, special_reader
from pipros.msg.base import CompiledMessage as _CompiledMessage
from pipros.msg.base import DeserializationError as _DeserializationError
from pipros.msg.base import Message as _Message
from pipros.msg.strings import TOO_SHORT as _TOO_SHORT
from pipros.msg.strings import RepeatedStrings as _RepeatedStrings
from pipros.msg.strings import read_strings as _read_strings
from pipros.msg.time import Duration as _Duration
from pipros.msg.time import Time as _Time

TYPE_CHECKING = False  # as type checkers see it; `typing` would double the time of a first import
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
    "_check_empty_elements",
    "_fixed_octets",
    "_len",
    "_list",
    "_mend",
    "_new",
    "_numbers",
    "_numpy_numbers",
    "_octets",
    "_range",
    "_read_strings",
    "_refuse",
    "_str",
    "_struct",
]

# The class that is made stands in the same namespace, and a definition may be called Message, or len.
_bytes, _len, _list, _range, _str = bytes, len, list, range, str
_UnicodeDecodeError, _ValueError = UnicodeDecodeError, ValueError
_new = object.__new__

_WRITE_ERRORS = (_struct.error, TypeError, ValueError, OverflowError, AttributeError)
"""What a field of the wrong kind leads to while a message is written."""

EMPTY_ELEMENTS_LIMIT = 65_536
"""The longest array of messages without any field: no byte bears witness to its length."""


def _refuse(message: _Message, error: Exception) -> NoReturn:
    """Says why `message` could not be written.

    Raises:
        SerializationError: always.
    """
    from pipros.msg.check import check_lengths

    message._check_types()
    check_lengths("self", message)
    raise SerializationError(f"{type(error)}: '{error}' when writing '{message}'")


def _mend(message: Any, data: Buffer, error: UnicodeDecodeError) -> Any:
    """Reads a message with replacements for what is no UTF-8; logs it once a type."""
    cls = type(message)
    if "_lenient_reader" not in vars(cls):
        import logging

        cls._lenient_reader = special_reader(cls, is_numpy=False)
        logging.getLogger("rosout").error(
            "Characters replaced when decoding message %s (will print only once): %s", cls._type, error
        )
    return read_specially(cls._lenient_reader, message, data, None)


def _fixed_octets(value: Any, length: int) -> bytes:
    """The value of a `uint8[n]` or `char[n]` field. `bytes` are cut or filled up as genpy does it."""
    if value.__class__ is bytes:
        return value
    octets = bytes(_octets(value))
    if len(octets) != length:
        raise ValueError("the array has another length")
    return octets


def _check_empty_elements(count: int) -> None:
    if count > EMPTY_ELEMENTS_LIMIT:
        raise _struct.error(f"an array of {count} empty messages is longer than {EMPTY_ELEMENTS_LIMIT}")
