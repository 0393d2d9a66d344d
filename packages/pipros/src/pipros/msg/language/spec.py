"""Interface definitions as plain values.

A `.msg` file becomes one `MessageSpec`, a `.srv` file two, and a `.action` file seven. Type names are always
complete (`std_msgs/Header`), even if the file uses a short form.
"""

from __future__ import annotations

from dataclasses import dataclass

from pipros.basics.errors import PiprosError
from pipros.basics.printable import listed

HEADER = "std_msgs/Header"
"""The type that a plain `Header` refers to. A publisher sets the `seq` of such a field."""

INTEGERS = {
    "int8": "b",
    "uint8": "B",
    "byte": "b",
    "char": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
}
FLOATS = {"float32": "f", "float64": "d"}
NUMBERS = {**INTEGERS, **FLOATS, "bool": "?"}
"""Types that are serialized as a single number, with their code in the `struct` module."""

TIMES = {"time": "II", "duration": "ii"}
"""Types that are serialized as seconds and nanoseconds."""

BUILTINS = frozenset((*NUMBERS, *TIMES, "string"))
CONSTANT_TYPES = frozenset((*NUMBERS, "string"))
OCTETS = frozenset(("uint8", "char"))
"""Types whose arrays become `bytes` in Python."""


class DefinitionError(PiprosError):
    """A definition violates the rules of the language.

    Attributes:
        file: the definition's path, or a substitute such as `<definition of package/Name>`.
        line: counted from 1; 0 if the error concerns the whole file.
        column: counted from 1; 0 if the error concerns the whole file.
        others: further errors in the same file.
    """

    def __init__(self, reason: str, *, file: str, line: int = 0, column: int = 0) -> None:
        self.reason = reason
        self.file = file
        self.line = line
        self.column = column
        self.others: tuple[DefinitionError, ...] = ()
        place = f"{file}:{line}:{column}" if line else file
        super().__init__(f"{listed(place)}: {listed(reason)}")  # the names may come from a peer or a bag


class UnknownType(DefinitionError):
    """A field's type has no definition."""


@dataclass(frozen=True, slots=True)
class FieldType:
    """The type of a field: `base`, `base[]` or `base[length]`.

    Attributes:
        digits: the length as written, possibly with leading zeros, because the MD5 sum depends on them.
    """

    base: str
    is_array: bool = False
    length: int | None = None
    digits: str = ""

    def __str__(self) -> str:
        return f"{self.base}[{self.digits}]" if self.is_array else self.base

    @property
    def is_builtin(self) -> bool:
        return self.base in BUILTINS


@dataclass(frozen=True, slots=True)
class Field:
    """A field declaration, `type name`. `line` and `column` give the position of the type."""

    type: FieldType
    name: str
    line: int = 0
    column: int = 0


@dataclass(frozen=True, slots=True)
class Constant:
    """A constant declaration, `type NAME=value`.

    `text` is the value as written, on which the MD5 sum depends.
    """

    type: str
    name: str
    value: bool | int | float | str
    text: str


@dataclass(frozen=True, slots=True)
class MessageSpec:
    """A message definition, or one part of a service or action definition.

    Attributes:
        type: `package/Name`.
        text: the definition as written.
        file: the source file, for error messages.
    """

    type: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...]
    text: str
    file: str

    @property
    def name(self) -> str:
        return self.type.partition("/")[2]

    @property
    def has_header(self) -> bool:
        """Whether the first field is `Header header`, whose `seq` a publisher sets."""
        if not self.fields:
            return False
        first = self.fields[0]
        return first.name == "header" and str(first.type) == HEADER


@dataclass(frozen=True, slots=True)
class ServiceSpec:
    """A service definition, which consists of a request and a response."""

    type: str
    request: MessageSpec
    response: MessageSpec
    text: str


@dataclass(frozen=True, slots=True)
class ActionSpec:
    """An action definition, as the seven messages derived from it."""

    type: str
    messages: tuple[MessageSpec, ...]
    text: str
