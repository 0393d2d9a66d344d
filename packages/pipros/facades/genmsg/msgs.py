"""`genmsg.msgs`: message definitions as genmsg objects."""

from __future__ import annotations

from typing import overload

from genmsg.base import EXT_MSG, MSG_DIR, SEP, InvalidMsgSpec, log
from genmsg.names import (
    is_legal_resource_base_name,
    is_legal_resource_name,
    package_resource_name,
    resource_name,
)
from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import BUILTINS, CONSTANT_TYPES, NUMBERS, DefinitionError, MessageSpec
from pipros.msg.language.spec import HEADER as HEADER_FULL_NAME

HEADER = "Header"
TIME = "time"
DURATION = "duration"
TIME_MSG = "uint32 secs\nuint32 nsecs"
DURATION_MSG = "int32 secs\nint32 nsecs"
_LAST = ("string", "bool", "char", "byte")
PRIMITIVE_TYPES = [*(name for name in NUMBERS if name not in _LAST), *_LAST]
BUILTIN_TYPES = [*PRIMITIVE_TYPES, TIME, DURATION]

__all__ = [
    "BUILTIN_TYPES",
    "DURATION",
    "DURATION_MSG",
    "EXT_MSG",
    "HEADER",
    "HEADER_FULL_NAME",
    "MSG_DIR",
    "PRIMITIVE_TYPES",
    "SEP",
    "TIME",
    "TIME_MSG",
    "Constant",
    "Field",
    "InvalidMsgSpec",
    "MsgSpec",
    "bare_msg_type",
    "is_builtin",
    "is_header_type",
    "is_valid_constant_type",
    "is_valid_msg_field_name",
    "is_valid_msg_type",
    "log",
    "package_resource_name",
    "parse_type",
    "resolve_type",
    "resource_name",
]


@overload
def bare_msg_type(msg_type: str) -> str: ...
@overload
def bare_msg_type(msg_type: None) -> None: ...
def bare_msg_type(msg_type: str | None) -> str | None:
    """Return the type without `[]` or `[n]`."""
    return None if msg_type is None else msg_type.partition("[")[0]


def resolve_type(msg_type: str, package_context: str) -> str:
    """Return the full name of a type that a definition in the package `package_context` refers to."""
    bare = bare_msg_type(msg_type)
    if bare in BUILTINS or SEP in bare:
        return msg_type
    if bare == HEADER:
        return HEADER_FULL_NAME
    return f"{package_context}{SEP}{msg_type}"


def parse_type(msg_type: str | None) -> tuple[str, bool, int | None]:
    """Return the base type, whether the type is an array, and the length of a fixed-size array.

    Raises:
        ValueError: the type is empty or an array of arrays, or the length is not a number.
    """
    if not msg_type:
        raise ValueError("Invalid empty type")
    base, bracket, length = msg_type.partition("[")
    if not bracket:
        return base, False, None
    if "[" in length:
        raise ValueError(f"Currently only support 1-dimensional array types: {msg_type}")
    try:
        return base, True, None if length == "]" else int(length[:-1])
    except ValueError:
        raise ValueError(f"Invalid array dimension: [{length[:-1]}]") from None


def is_valid_msg_type(x: str | None) -> bool:
    """Return True for a valid field type, with or without brackets."""
    if not x:
        return False
    base, bracket, length = x.partition("[")
    if not is_legal_resource_name(base) or not base:
        return False
    return not bracket or (length.endswith("]") and (length == "]" or length[:-1].isdigit()))


def is_valid_constant_type(x: str) -> bool:
    return x in CONSTANT_TYPES


def is_valid_msg_field_name(x: str) -> bool:
    return is_legal_resource_base_name(x)


def is_header_type(msg_type: str) -> bool:
    return msg_type in (HEADER, HEADER_FULL_NAME, "roslib/Header")


def is_builtin(msg_type_name: str) -> bool:
    return msg_type_name in BUILTINS


class Constant:
    """A constant in a message. `val_text` is the value as written in the definition."""

    __slots__ = ["name", "type", "val", "val_text"]

    def __init__(self, type_: str, name: str, val: bool | int | float | str, val_text: str) -> None:
        if name is None or val is None or val_text is None:
            raise ValueError("Constant must have non-None parameters")
        self.type = type_
        self.name = name
        self.val = val
        self.val_text = val_text

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Constant):
            return False
        return (self.type, self.name, self.val) == (other.type, other.name, other.val)

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        return f"{self.type} {self.name}={self.val}"

    __repr__ = __str__


class Field:
    """A field in a message, with its type split into parts."""

    def __init__(self, name: str, type: str) -> None:  # noqa: A002 # the name in genmsg
        self.name = name
        self.type = type
        self.base_type, self.is_array, self.array_len = parse_type(type)
        self.is_header = is_header_type(type)
        self.is_builtin = is_builtin(self.base_type)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Field) and (self.name, self.type) == (other.name, other.type)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"[{self.name}, {self.type}, {self.base_type}, {self.is_array}, {self.array_len}]"


class MsgSpec:
    """A message definition."""

    def __init__(
        self,
        types: list[str],
        names: list[str],
        constants: list[Constant],
        text: str,
        full_name: str,
        package: str = "",
        short_name: str = "",
    ) -> None:
        if len(types) != len(names):
            raise AssertionError(f"len({types}) != len({names})")
        if len(set(names)) != len(names):
            raise InvalidMsgSpec(f"Duplicate field names in message: {names}")
        for kind in types:
            try:
                parse_type(kind)
            except ValueError as error:
                raise InvalidMsgSpec(f"invalid field: {error}") from None
        self.types = types
        self.names = names
        self.constants = constants
        self.text = text
        self.full_name = full_name
        self.package = package or full_name.partition(SEP)[0]
        self.short_name = short_name or full_name.partition(SEP)[2]

    @classmethod
    def of(cls, spec: MessageSpec) -> MsgSpec:
        return cls(
            [str(field.type) for field in spec.fields],
            [field.name for field in spec.fields],
            [Constant(item.type, item.name, item.value, item.text) for item in spec.constants],
            spec.text,
            spec.type,
        )

    def definition(self) -> MessageSpec:
        """Return the corresponding pipros object.

        Raises:
            InvalidMsgSpec: the text is invalid.
        """
        try:
            return parse_message(self.text, self.full_name)
        except DefinitionError as error:
            raise InvalidMsgSpec(str(error)) from error

    def fields(self) -> list[tuple[str, str]]:
        return list(zip(self.types, self.names, strict=True))

    def parsed_fields(self) -> list[Field]:
        return [Field(name, kind) for kind, name in self.fields()]

    @property
    def header_present(self) -> bool:
        return self.has_header()

    def has_header(self) -> bool:
        return self.fields()[:1] == [(HEADER_FULL_NAME, "header")]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MsgSpec):
            return False
        mine = (self.types, self.names, self.constants, self.text, self.full_name)
        return mine == (other.types, other.names, other.constants, other.text, other.full_name)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        parts = [
            repr(part) for part in ([self.constants] if self.constants else []) + [self.types, self.names]
        ]
        return f"MsgSpec[{', '.join(parts)}]"
