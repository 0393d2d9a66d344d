"""`Message`, the base of all message classes, with the methods of genpy's class.

Generated classes (`compiler.py`) add the fields and the codec. Classes from genuine genpy also derive from
this one, through the `genpy` facade.
"""

from __future__ import annotations

import struct

TYPE_CHECKING = False  # true for type checkers; importing `typing` would double the time of a first import
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any, ClassVar, Protocol, TypeVar

    AnyMessage = TypeVar("AnyMessage", bound="Message")

    class Writable(Protocol):
        def write(self, data: Any, /) -> object: ...


Buffer = bytes | memoryview

struct_I = struct.Struct("<I")  # noqa: N816 # genuine generated modules import this name


class Buffers(list[Buffer]):
    """Collects the output of a message as separate buffers, so that a transport need not copy them."""

    write = list.append


class Message:
    """A message. `__slots__` names its fields in the order of the definition."""

    __slots__ = ["_connection_header"]

    _type: ClassVar[str]
    _md5sum: ClassVar[str]
    _full_text: ClassVar[str]
    _has_header: ClassVar[bool]
    _slot_types: ClassVar[list[str]]
    _connection_header: dict[str, str]

    def __init__(self, *args: Any, **kwds: Any) -> None:
        """Set all fields in order, or some by name; the others become None.

        Raises:
            TypeError: too few or too many values, or values of both kinds.
            AttributeError: a name is not a field.
        """
        fields = self.__slots__
        if args:
            if kwds:
                raise TypeError("Message constructor may only use args OR keywords, not both")
            if len(args) != len(fields):
                raise TypeError(f"Invalid number of arguments, args should be {fields} args are{args}")
            for name, value in zip(fields, args, strict=True):
                setattr(self, name, value)
            return
        for name in kwds:
            if name not in fields:
                raise AttributeError(f"{name} is not an attribute of {self.__class__.__name__}")
        for name in fields:
            setattr(self, name, kwds.get(name))

    def __getstate__(self) -> list[Any]:
        return [getattr(self, name) for name in self.__slots__]

    def __setstate__(self, state: Sequence[Any]) -> None:
        for name, value in zip(self.__slots__, state, strict=False):
            setattr(self, name, value)

    def _get_types(self) -> list[str]:
        return self._slot_types

    def _check_types(self, exc: Exception | None = None) -> None:
        """Raise an error that names the field that does not fit its type.

        Args:
            exc: the error that serializing the message raised.

        Raises:
            SerializationError: names the field, or has the text of `exc` if all fields fit.
        """
        from pipros.msg.check import check_type
        from pipros.msg.errors import SerializationError

        for name, type_name in zip(self.__slots__, self._get_types(), strict=True):
            check_type(name, type_name, getattr(self, name))
        if exc is not None:
            raise SerializationError(str(exc))

    def serialize(self, buff: Writable) -> None:
        """Write the message, or nothing if a field does not fit its type.

        Raises:
            SerializationError: names the field.
        """

    def deserialize(self: AnyMessage, str: Buffer) -> AnyMessage:  # noqa: A002, ARG002 # genpy's name for it
        """Read all fields; ignore bytes after them.

        Raises:
            DeserializationError: there are too few bytes.
        """
        return self

    def deserialize_numpy(self: AnyMessage, str: Buffer, numpy: Any) -> AnyMessage:  # noqa: A002, ARG002
        return self

    def serialize_numpy(self, buff: Writable, numpy: Any) -> None:  # noqa: ARG002 # serialize takes arrays
        """Write the message with `serialize`, which accepts numpy arrays without a copy anyway."""
        self.serialize(buff)

    def _to_buffers(self) -> list[Buffer]:
        """Return the serialized message as buffers; large arrays are not copied.

        Raises:
            SerializationError: names the field that does not fit.
        """
        buffers = Buffers()
        self.serialize(buffers)
        return buffers

    @classmethod
    def _from_bytes(cls: type[AnyMessage], data: Buffer) -> AnyMessage:
        """Return a new message from its serialized form.

        Raises:
            DeserializationError: there are too few bytes.
        """
        return cls().deserialize(bytes(data))

    def __repr__(self) -> str:
        from pipros.msg.text import strify_message

        return strify_message(self)

    __str__ = __repr__

    def __eq__(self, other: object) -> bool:
        """Return True for a message of the same class with equal fields; a list may equal a tuple."""
        if not isinstance(other, self.__class__):
            return False
        for name in self.__slots__:
            try:
                mine, others = getattr(self, name), getattr(other, name)
            except AttributeError:
                return False
            if type(mine) is not type(others) and {type(mine), type(others)} <= {list, tuple}:
                mine, others = tuple(mine), tuple(others)
            if not mine == others:
                return False
        return True

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None  # type: ignore[assignment] # messages are mutable
