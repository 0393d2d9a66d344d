"""Makes Python classes out of definitions.

`message_source` gives the source of one module with one message class, `service_source` the one of
a service with its two halves. Whatever stands in a definition enters the source only as a name
that the grammar of definitions checked, or through `repr`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from pipros.msg.base import CompiledMessage
from pipros.msg.decode import deserialize_body
from pipros.msg.digest import Lookup, full_text, message_md5, service_md5
from pipros.msg.encode import serialize_body
from pipros.msg.source import Names, python_name
from pipros.msg.spec import (
    FLOATS,
    INTEGERS,
    OCTETS,
    DefinitionError,
    FieldType,
    MessageSpec,
    ServiceSpec,
)

DEFAULT_LIMIT = 1 << 22
"""The most values that a new message may hold: fixed arrays in fixed arrays multiply."""

_PREAMBLE = "from pipros.msg.runtime import *\n"

_METHODS = frozenset(("serialize", "deserialize", "serialize_numpy", "deserialize_numpy"))
_ATTRIBUTES = frozenset(("_md5sum", "_type", "_has_header", "_full_text", "_slot_types"))
_READERS = frozenset(("_numpy_reader", "_lenient_reader"))
_INTERNAL = _ATTRIBUTES | _READERS | frozenset(name for name in dir(CompiledMessage) if name[0] == "_")
"""What a constant must not replace; genpy lets it, and the class breaks."""


def message_source(spec: MessageSpec, lookup: Lookup) -> tuple[str, Mapping[str, str]]:
    """The source of a module with the class of `spec`.

    Returns:
        The source, and the names under which it expects the classes of embedded messages:
        `{"std_msgs/Header": "_0_std_msgs_Header"}`.

    Raises:
        DefinitionError: when no class can be made of the definition.
    """
    names = Names()
    lines = _message_class(spec, lookup, names)
    return _module(lines, names), names.classes


def service_source(spec: ServiceSpec, lookup: Lookup) -> tuple[str, Mapping[str, str]]:
    """As `message_source`, for a service: classes `Name`, `NameRequest` and `NameResponse`."""
    names = Names()
    lines: list[str] = []
    for half in (spec.request, spec.response):
        lines += [*_message_class(half, lookup, names), "", ""]
    name = _class_name(spec.request, spec.type.partition("/")[2])
    lines += [
        f"class {name}:",
        f"    _type = {spec.type!r}",
        f"    _md5sum = {service_md5(spec, lookup)!r}",
        f"    _request_class = {spec.request.name}",
        f"    _response_class = {spec.response.name}",
    ]
    return _module(lines, names), names.classes


def reader_source(spec: MessageSpec, lookup: Lookup, *, is_numpy: bool) -> str:
    """The source of a module with a function `read(self, str, numpy)`.

    It reads what `deserialize` reads, but takes any bytes for a string, with replacements for what
    is no UTF-8, and makes numpy arrays if `is_numpy`.
    """
    names = Names()
    body = deserialize_body(spec, lookup, names, indent=1, errors="replace", is_numpy=is_numpy)
    return _module(["def read(self, str, numpy):", *body], names)


def _module(lines: list[str], names: Names) -> str:
    structs = [
        f"{name} = _struct.Struct({layout!r}).{method}" for (layout, method), name in names.structs.items()
    ]
    strings = [f"{name} = _RepeatedStrings({errors!r}).read" for name, errors in names.strings.items()]
    return "\n".join((_PREAMBLE, *structs, *strings, "", "", *lines, ""))


def _message_class(spec: MessageSpec, lookup: Lookup, names: Names) -> list[str]:
    slots = _slots(spec)
    for constant in spec.constants:
        if constant.name in _INTERNAL:
            reason = f"a Python message cannot have this constant: the name {constant.name} is taken"
            raise DefinitionError(reason, file=spec.file)
    text = full_text(spec, lookup)
    if _default_size(spec, lookup, {}) > DEFAULT_LIMIT:
        raise DefinitionError(f"a new message would hold more than {DEFAULT_LIMIT} values", file=spec.file)
    return [
        f"class {_class_name(spec, spec.name)}(_CompiledMessage):",
        f"    _md5sum = {message_md5(spec, lookup)!r}",
        f"    _type = {spec.type!r}",
        f"    _has_header = {spec.has_header!r}",
        f"    _full_text = {text!r}",
        *(f"    {python_name(constant.name)} = {_literal(constant.value)}" for constant in spec.constants),
        f"    __slots__ = {slots!r}",
        f"    _slot_types = {[str(field.type) for field in spec.fields]!r}",
        "",
        *_init(spec, slots, names),
        "",
        "    def _get_types(self):",
        "        return self._slot_types",
        "",
        "    def serialize(self, buff):",
        "        try:",
        *serialize_body(spec, lookup, names, indent=3),
        "        except _WRITE_ERRORS as error:",
        "            _refuse(self, error)",
        "",
        "    def deserialize(self, str):",
        "        try:",
        *deserialize_body(spec, lookup, names, indent=3),
        "        except _UnicodeDecodeError as error:",
        "            return _mend(self, str, error)",
        "        except _struct.error as error:",
        "            raise _DeserializationError(error) from None",
        "        return self",
    ]


def _init(spec: MessageSpec, slots: list[str], names: Names) -> list[str]:
    if not slots:
        return []
    defaults = {slot: _default(field.type, names) for slot, field in zip(slots, spec.fields, strict=True)}
    lines = [
        "    def __init__(self, *args, **kwds):",
        "        if args:",
        f"            if kwds or _len(args) != {len(slots)}:",
        "                _Message.__init__(self, *args, **kwds)  # says what is wrong",
        f"            ({', '.join(f'self.{slot}' for slot in slots)},) = args",
        "        elif kwds:",
        "            take = kwds.pop",
        *(f"            self.{slot} = take({slot!r}, None)" for slot in slots),
        "            if kwds:",
        "                _Message.__init__(self, **kwds)  # says what is wrong",
        "        else:",
        *(f"            self.{slot} = {default}" for slot, default in defaults.items()),
        "            return",
    ]
    for slot, default in defaults.items():
        lines += [f"        if self.{slot} is None:", f"            self.{slot} = {default}"]
    return lines


def _default(kind: FieldType, names: Names) -> str:
    """An expression for the value of a field that nobody set."""
    if kind.is_array and not kind.length:
        return 'b""' if kind.base in OCTETS else "[]"
    if kind.base in OCTETS and kind.is_array:
        return f"_bytes({kind.length})"
    if kind.base in INTEGERS:
        single = "0"
    elif kind.base in FLOATS:
        single = "0.0"
    elif kind.base == "bool":
        single = "False"
    elif kind.base == "string":
        single = '""'
    else:
        maker = f"_{kind.base.title()}" if kind.is_builtin else names.message_class(kind.base)
        return f"[{maker}() for _ in _range({kind.length})]" if kind.is_array else f"{maker}()"
    return f"[{single}] * {kind.length}" if kind.is_array else single


def _default_size(spec: MessageSpec, lookup: Lookup, known: dict[str, int]) -> int:
    """The number of values that a new message holds, eight octets being one value."""
    size = 0
    for field in spec.fields:
        kind = field.type
        if kind.is_builtin:
            single = 1
        else:
            if kind.base not in known:
                known[kind.base] = 1 + _default_size(lookup(kind.base), lookup, known)
            single = known[kind.base]
        count = (kind.length or 0) if kind.is_array else 1
        size += 1 + (count // 8 if kind.base in OCTETS else count * single)
    return size


def _slots(spec: MessageSpec) -> list[str]:
    slots: list[str] = []
    for field in spec.fields:
        slot = python_name(field.name)
        if slot in slots or slot in _METHODS:
            raise DefinitionError(
                f"a Python message cannot have this field: the name {slot} is taken",
                file=spec.file,
                line=field.line,
                column=field.column,
            )
        slots.append(slot)
    return slots


def _class_name(spec: MessageSpec, name: str) -> str:
    if python_name(name) != name:
        raise DefinitionError(f"[{name}] cannot be the name of a Python class", file=spec.file)
    return name


def _literal(value: bool | int | float | str) -> str:
    """Source that gives `value` back without calling anything: a constant may be named `float`."""
    if value == math.inf:
        return "1e999"
    if value == -math.inf:
        return "-1e999"
    return "(1e999 - 1e999)" if value != value else repr(value)
