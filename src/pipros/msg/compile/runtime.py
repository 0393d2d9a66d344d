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
    "_allowed",
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
    "_still_allowed",
    "_str",
    "_struct",
]

# The generated class is in the same namespace, and a definition may be called Message, or len.
_bytes, _len, _list, _range, _str = bytes, len, list, range, str
_UnicodeDecodeError, _ValueError = UnicodeDecodeError, ValueError
_new = object.__new__

_WRITE_ERRORS = (_struct.error, TypeError, ValueError, OverflowError, AttributeError)
"""The errors of writing a message with a field of the wrong kind."""


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


def _allowed(values: int) -> int:
    """How many more values a message may hold, beyond `values` and those that its bytes pay for.

    Raises:
        struct.error: when `values` are too many already.
    """
    from pipros.basics.limits import process_limits

    return _still_allowed(process_limits().empty_elements, values)


def _still_allowed(allowed: int, values: int) -> int:
    """`allowed` minus `values`. Raises the same errors as `_allowed`."""
    if values > allowed:
        raise _struct.error(
            f"it holds {values - allowed} values too many in elements that take few bytes or none"
        )
    return allowed - values
