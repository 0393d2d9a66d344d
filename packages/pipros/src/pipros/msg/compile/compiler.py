"""Compile definitions to the source code of Python classes.

`message_source` returns the source of a module with one message class. `service_source` returns the source of
a module with a service class and its request and response classes. Text from a definition enters the source
only as a name that has been checked against the grammar of definitions, or through `repr`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from pipros.basics.limits import Limits, limit_text, process_limits
from pipros.msg.base import Message
from pipros.msg.compile.arrays import EMPTY_ELEMENTS
from pipros.msg.compile.decode import deserialize_body
from pipros.msg.compile.emitter import Names, python_name
from pipros.msg.compile.encode import serialize_body
from pipros.msg.compile.layout import MESSAGE_VALUES, TypeLayout, TypeLayouts
from pipros.msg.language.digest import CompleteSpec, Lookup, complete, md5_of_halves
from pipros.msg.language.spec import (
    FLOATS,
    INTEGERS,
    OCTETS,
    DefinitionError,
    FieldType,
    MessageSpec,
    ServiceSpec,
)

_PREAMBLE = "from pipros.msg.compile.runtime import *\n"

_METHODS = frozenset(("serialize", "deserialize", "serialize_numpy", "deserialize_numpy"))
_ATTRIBUTES = frozenset(("_md5sum", "_type", "_has_header", "_full_text", "_slot_types"))
_READERS = frozenset(("_numpy_reader", "_lenient_reader", "_view_reader", "_numpy_view_reader"))
_INTERNAL = _ATTRIBUTES | _READERS | frozenset(name for name in dir(Message) if name[0] == "_")
"""Names that a constant must not replace. genpy allows this, and creates a class that does not work."""


def message_source(
    spec: MessageSpec, lookup: Lookup, limits: Limits | None = None
) -> tuple[str, Mapping[str, str]]:
    """Return the source of a module with the class for `spec`.

    Args:
        limits: defaults to the process-wide limits.

    Returns:
        The source, and the names by which it refers to the classes of embedded messages:
        `{"std_msgs/Header": "_0_std_msgs_Header"}`.

    Raises:
        DefinitionError: no class can be generated from the definition.
    """
    names = Names()
    whole, layout = _checked(spec, lookup, limits or process_limits())
    lines = _message_class(whole, layout, names)
    return _module(lines, names), names.classes


def service_source(
    spec: ServiceSpec, lookup: Lookup, limits: Limits | None = None
) -> tuple[str, Mapping[str, str]]:
    """Like `message_source`, but for a service, with the classes `Name`, `NameRequest` and `NameResponse`."""
    names = Names()
    lines: list[str] = []
    halves: list[CompleteSpec] = []
    for half in (spec.request, spec.response):
        whole, layout = _checked(half, lookup, limits or process_limits())
        halves.append(whole)
        lines += [*_message_class(whole, layout, names), "", ""]
    name = _class_name(spec.request, spec.type.partition("/")[2])
    lines += [
        f"class {name}:",
        f"    _type = {spec.type!r}",
        f"    _md5sum = {md5_of_halves(*halves)!r}",
        f"    _request_class = {spec.request.name}",
        f"    _response_class = {spec.response.name}",
    ]
    return _module(lines, names), names.classes


def reader_source(
    spec: MessageSpec,
    lookup: Lookup,
    *,
    is_numpy: bool = False,
    views_octets: bool = False,
    is_plain: bool = False,
) -> str:
    """Return the source of a module with a function `read(self, str, numpy)`.

    The function is like `deserialize`, but replaces invalid UTF-8 in strings. It reads arrays of numbers as
    numpy arrays if `is_numpy` is true, and `uint8[]` and `char[]` fields if `views_octets` is true. If
    `is_plain` is true, `self` and embedded messages are dictionaries; see `pipros.msg.compile.plain`.
    """
    names = Names()
    body = deserialize_body(
        TypeLayouts(lookup).of(spec),
        names,
        indent=1,
        errors="replace",
        is_numpy=is_numpy,
        views_octets=views_octets,
        is_plain=is_plain,
    )
    return _module(["def read(self, str, numpy):", *body], names)


def _module(lines: list[str], names: Names) -> str:
    structs = [
        f"{name} = _struct.Struct({layout!r}).{method}" for (layout, method), name in names.structs.items()
    ]
    strings = [f"{name} = _RepeatedStrings({errors!r}).read" for name, errors in names.strings.items()]
    return "\n".join((_PREAMBLE, *structs, *strings, "", "", *lines, ""))


def _checked(spec: MessageSpec, lookup: Lookup, limits: Limits) -> tuple[CompleteSpec, TypeLayout]:
    """Check a definition. Return it with all embedded definitions, and its layout.

    Raises:
        DefinitionError: no class can be generated from the definition.
    """
    _slots(spec)
    for constant in spec.constants:
        if constant.name in _INTERNAL:
            reason = f"a Python message cannot have this constant: the name {constant.name} is taken"
            raise DefinitionError(reason, file=spec.file)
    # This also detects types that contain themselves, for which no layout exists.
    whole = complete(spec, lookup)
    layout = TypeLayouts(lookup).of(spec)
    if layout.code_size > limits.definition_fields:
        limit = limit_text("definition_fields", limits.definition_fields)
        raise DefinitionError(f"the message has {layout.code_size} fields in total; {limit}", file=spec.file)
    if layout.value_count > MESSAGE_VALUES:  # the sizes of nested fixed arrays multiply
        limit = f"the limit is {MESSAGE_VALUES}"
        raise DefinitionError(f"a new message would contain too many values; {limit}", file=spec.file)
    if layout.unpaid_values > EMPTY_ELEMENTS:  # a reader would reject every such message
        limit = f"the limit is {EMPTY_ELEMENTS}"
        raise DefinitionError(
            "every message would exceed the budget of eight values per byte by "
            f"{layout.unpaid_values} values; {limit}",
            file=spec.file,
        )
    return whole, layout


def _message_class(whole: CompleteSpec, layout: TypeLayout, names: Names) -> list[str]:
    spec, slots = whole.spec, _slots(whole.spec)
    return [
        f"class {_class_name(spec, spec.name)}(_CompiledMessage):",
        f"    _md5sum = {whole.md5()!r}",
        f"    _type = {spec.type!r}",
        f"    _has_header = {spec.has_header!r}",
        f"    _full_text = {whole.full_text()!r}",
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
        *serialize_body(layout, names, indent=3),
        "        except _WRITE_ERRORS as error:",
        "            _raise_write_error(self, error)",
        "",
        "    def deserialize(self, str):",
        "        try:",
        *deserialize_body(layout, names, indent=3),
        "        except _UnicodeDecodeError as error:",
        "            return _reread_leniently(self, str, error)",
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
        "                _Message.__init__(self, *args, **kwds)  # raises the error",
        f"            ({', '.join(f'self.{slot}' for slot in slots)},) = args",
        "        elif kwds:",
        "            take = kwds.pop",
        *(f"            self.{slot} = take({slot!r}, None)" for slot in slots),
        "            if kwds:",
        "                _Message.__init__(self, **kwds)  # raises the error",
        "        else:",
        *(f"            self.{slot} = {default}" for slot, default in defaults.items()),
        "            return",
    ]
    for slot, default in defaults.items():
        lines += [f"        if self.{slot} is None:", f"            self.{slot} = {default}"]
    return lines


def _default(kind: FieldType, names: Names) -> str:
    """Return an expression for the default value of a field."""
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


def _slots(spec: MessageSpec) -> list[str]:
    slots: dict[str, None] = {}
    for field in spec.fields:
        slot = python_name(field.name)
        if slot in slots or slot in _METHODS:
            raise DefinitionError(
                f"a Python message cannot have this field: the name {slot} is taken",
                file=spec.file,
                line=field.line,
                column=field.column,
            )
        slots[slot] = None
    return list(slots)


def _class_name(spec: MessageSpec, name: str) -> str:
    if python_name(name) != name:
        raise DefinitionError(f"[{name}] cannot be a Python class name", file=spec.file)
    return name


def _literal(value: bool | int | float | str) -> str:
    """Return an expression for `value` that contains no calls, because a constant may be named `float`."""
    if value == math.inf:
        return "1e999"
    if value == -math.inf:
        return "-1e999"
    return "(1e999 - 1e999)" if value != value else repr(value)
