"""Descriptions of message types, as the services of rosapi return them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.language.full_text import specs_from_text
from pipros.msg.language.spec import NUMBERS, FieldType, MessageSpec

_NOT_AN_ARRAY: Final = -1
_ANY_LENGTH: Final = 0
_TIMES: Final = {"time": "uint32", "duration": "int32"}


def full_text(kind: str) -> str:
    try:
        return load_message_class(kind)._full_text if kind else ""
    except PiprosError:  # the type is not installed
        return ""


def typedefs(message_class: Any) -> list[Any]:
    """Return a TypeDef for a type and for each embedded type, outermost first."""
    typedef: Any = load_message_class("rosapi/TypeDef")
    specs = specs_from_text(message_class._type, message_class._full_text)
    return [typedef(**found) for found in described(message_class._type, specs, set())]


def described(kind: str, specs: Mapping[str, MessageSpec], seen: set[str]) -> Iterator[dict[str, Any]]:
    if kind in seen or (kind not in specs and kind not in _TIMES):
        return
    seen.add(kind)
    if kind in _TIMES:
        parts = [FieldType(_TIMES[kind])] * 2
        yield _typedef(kind, ["secs", "nsecs"], parts, MessageSpec(kind, (), (), "", ""))
        return
    spec = specs[kind]
    yield _typedef(kind, [field.name for field in spec.fields], [each.type for each in spec.fields], spec)
    for each in spec.fields:
        yield from described(each.type.base, specs, seen)


def _typedef(
    kind: str, names: Sequence[str], types: Sequence[FieldType], spec: MessageSpec
) -> dict[str, Any]:
    return {
        "type": kind,
        "fieldnames": list(names),
        "fieldtypes": [each.base for each in types],
        "fieldarraylen": [(each.length or _ANY_LENGTH) if each.is_array else _NOT_AN_ARRAY for each in types],
        "examples": [_example(each) for each in types],
        "constnames": [constant.name for constant in spec.constants],
        "constvalues": [str(constant.value) for constant in spec.constants],
    }


def _example(kind: FieldType) -> str:
    """Return the default value of a field as text."""
    if kind.is_array:
        return "[]"
    if kind.base == "bool":
        return "False"
    if kind.base in NUMBERS:
        return "0.0" if kind.base.startswith("float") else "0"
    return "" if kind.base == "string" else "{}"
