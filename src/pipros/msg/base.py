"""`Message`, the base of all message classes, with the surface that genpy gives it.

Generated classes (`compiler.py`) add the fields and the codec. Classes that genuine genpy
generated derive from this one as well, through the `genpy` facade.
"""

from __future__ import annotations

import struct

from pipros.errors import PiprosError

TYPE_CHECKING = False  # as type checkers see it; `typing` would double the time of a first import
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any, ClassVar, Protocol, TypeVar

    AnyMessage = TypeVar("AnyMessage", bound="Message")
    Reader = Callable[[Any, "Buffer", Any], None]

    class Writable(Protocol):
        def write(self, data: Any, /) -> object: ...


Buffer = bytes | memoryview

struct_I = struct.Struct("<I")  # noqa: N816 # genuine generated modules import this name


class MessageException(PiprosError):
    """Something is wrong with a message."""

    __module__ = "genpy.message"  # the name that people know it by, as for the classes below


class SerializationError(MessageException):
    """A field of a message holds what its type cannot carry."""

    __module__ = "genpy.message"


class DeserializationError(MessageException):
    """Bytes are no message of the type that they should be."""

    __module__ = "genpy.message"


class Buffers(list[Buffer]):
    """Takes what a message writes as separate buffers, for a transport that sends them uncopied."""

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
        """Takes all fields in order, or any of them by name; the others become None.

        Raises:
            TypeError: for too few or too many values, and for values of both kinds.
            AttributeError: for a name that is no field.
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
        """Finds the field that does not fit its type.

        Args:
            exc: what went wrong when the message was serialized.

        Raises:
            SerializationError: naming the field; or with the text of `exc` if all fields fit.
        """
        from pipros.msg.check import check_type

        for name, type_name in zip(self.__slots__, self._get_types(), strict=True):
            check_type(name, type_name, getattr(self, name))
        if exc is not None:
            raise SerializationError(str(exc))

    def serialize(self, buff: Writable) -> None:
        """Writes the message. Nothing is written when a field does not fit.

        Raises:
            SerializationError: naming the field.
        """

    def deserialize(self: AnyMessage, str: Buffer) -> AnyMessage:  # noqa: A002, ARG002 # genpy's name for it
        """Reads all fields; bytes behind them are ignored.

        Raises:
            DeserializationError: when there are too few bytes.
        """
        return self

    def deserialize_numpy(self: AnyMessage, str: Buffer, numpy: Any) -> AnyMessage:  # noqa: A002, ARG002
        return self

    def serialize_numpy(self, buff: Writable, numpy: Any) -> None:  # noqa: ARG002 # serialize takes arrays
        """As `serialize`, which takes numpy arrays without a copy."""
        self.serialize(buff)

    def _to_buffers(self) -> list[Buffer]:
        """The serialized message in pieces; large arrays stand among them uncopied.

        Raises:
            SerializationError: naming the field that does not fit.
        """
        buffers = Buffers()
        self.serialize(buffers)
        return buffers

    @classmethod
    def _from_bytes(cls: type[AnyMessage], data: Buffer) -> AnyMessage:
        """A new message from its serialized form.

        Raises:
            DeserializationError: when there are too few bytes.
        """
        return cls().deserialize(bytes(data))

    def __repr__(self) -> str:
        from pipros.msg.text import strify_message

        return strify_message(self)

    __str__ = __repr__

    def __eq__(self, other: object) -> bool:
        """True for a message of the same class with equal fields; lists and tuples may be equal."""
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

    __hash__ = None  # type: ignore[assignment] # messages change


class CompiledMessage(Message):
    """A message class made by `compiler.py`."""

    __slots__ = ()

    def deserialize_numpy(self: AnyMessage, str: Buffer, numpy: Any) -> AnyMessage:  # noqa: A002
        """As `deserialize`, with numpy arrays that share the memory of `str` for arrays of numbers.

        Octets are `bytes` and booleans a list, as in genpy.

        Args:
            numpy: the module numpy.
        """
        cls: Any = type(self)
        if "_numpy_reader" not in vars(cls):
            cls._numpy_reader = special_reader(cls, is_numpy=True)
        return read_specially(cls._numpy_reader, self, str, numpy)

    @classmethod
    def _from_bytes(cls: type[AnyMessage], data: Buffer) -> AnyMessage:
        return _new(cls).deserialize(data)


_new = object.__new__


def special_reader(cls: type[Message], *, is_numpy: bool) -> Reader:
    """Compiles a reader that few messages need, from the full text of a compiled class."""
    from pipros.msg.compiler import reader_source
    from pipros.msg.dynamic import specs_from_text

    specs = specs_from_text(cls._type, cls._full_text)
    source = reader_source(specs[cls._type], specs.__getitem__, is_numpy=is_numpy)
    compiled: Any = next(one for one in cls.__mro__ if CompiledMessage in one.__bases__)
    names = dict(compiled.deserialize.__globals__)  # has the embedded classes
    exec(compile(source, f"<reader of {cls._type}>", "exec"), names)  # noqa: S102 # made by our compiler
    reader: Reader = names["read"]
    return reader


def read_specially(reader: Reader, message: AnyMessage, data: Buffer, numpy: Any) -> AnyMessage:
    """Fills `message` by a reader that `special_reader` made.

    Raises:
        DeserializationError: when there are too few bytes.
    """
    try:
        reader(message, data, numpy)
    except struct.error as error:
        raise DeserializationError(error) from None
    return message
