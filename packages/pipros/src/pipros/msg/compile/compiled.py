"""`CompiledMessage`, the base class of generated message classes.

Readers for rare cases (numpy arrays, and strings that are not UTF-8) are compiled when first needed.
"""

from __future__ import annotations

import struct

from pipros.msg.base import Buffer, Message
from pipros.msg.errors import DeserializationError

# Type checkers treat this as True. Importing `typing` would double the time of the first message import.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from pipros.msg.base import AnyMessage

    Reader = Callable[[Any, Buffer, Any], None]

_new = object.__new__


class CompiledMessage(Message):
    """Base class of the message classes that `compiler.py` generates."""

    __slots__ = ()

    def deserialize_numpy(self: AnyMessage, str: Buffer, numpy: Any) -> AnyMessage:  # noqa: A002
        """Like `deserialize`, but read arrays of numbers as numpy arrays, which share the memory of `str`.

        As in genpy, octets become `bytes` and booleans become a list.

        Args:
            numpy: the `numpy` module.

        Raises:
            DeserializationError: there are too few bytes.
        """
        cls: Any = type(self)
        if "_numpy_reader" not in vars(cls):
            cls._numpy_reader = special_reader(cls, is_numpy=True)
        return read_specially(cls._numpy_reader, self, str, numpy)

    def _deserialize_views(
        self: AnyMessage, data: Buffer, numpy: Any, *, has_numbers: bool = False
    ) -> AnyMessage:
        """Like `deserialize`, but read `uint8[]` and `char[]` fields as numpy arrays.

        The arrays share the memory of `data`, and are read-only if `data` is.

        Args:
            numpy: the `numpy` module.
            has_numbers: whether to read all arrays of numbers as numpy arrays, as `deserialize_numpy` does.

        Raises:
            DeserializationError: there are too few bytes.
        """
        cls: Any = type(self)
        name = "_numpy_view_reader" if has_numbers else "_view_reader"
        if name not in vars(cls):
            setattr(cls, name, special_reader(cls, is_numpy=has_numbers, views_octets=True))
        return read_specially(getattr(cls, name), self, data, numpy)

    @classmethod
    def _from_bytes(cls: type[AnyMessage], data: Buffer) -> AnyMessage:
        return _new(cls).deserialize(data)


def special_reader(cls: type[Message], *, is_numpy: bool, views_octets: bool = False) -> Reader:
    """Compile a reader that replaces invalid UTF-8 in strings; see `reader_source`."""
    from pipros.msg.compile.compiler import reader_source
    from pipros.msg.compile.run import run
    from pipros.msg.language.full_text import specs_from_text

    specs = specs_from_text(cls._type, cls._full_text)
    source = reader_source(specs[cls._type], specs.__getitem__, is_numpy=is_numpy, views_octets=views_octets)
    compiled: Any = next(base for base in cls.__mro__ if CompiledMessage in base.__bases__)
    names = dict(compiled.deserialize.__globals__)  # names in the generated module
    reader: Reader = run(source, names, f"<reader of {cls._type}>")["read"]
    return reader


def read_specially(reader: Reader, message: AnyMessage, data: Buffer, numpy: Any) -> AnyMessage:
    """Read `message` with a reader from `special_reader`.

    Raises:
        DeserializationError: there are too few bytes.
    """
    try:
        reader(message, data, numpy)
    except struct.error as error:
        raise DeserializationError(error) from None
    return message
