"""Serialized default values of fields that only the target of a conversion has."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

from pipros.safe.yaml import YamlError, load
from pipros_rosbag2.conversion.errors import NotConvertible
from pipros_rosbag2.conversion.values import Value, ValueKind, Values
from pipros_rosbag2.interfaces.cdr import WIDE_BYTES, wide
from pipros_rosbag2.interfaces.spec import Form

_U32 = struct.Struct("<I")
_CODES = {
    (ValueKind.INTEGER, 1): "B",
    (ValueKind.INTEGER, 2): "H",
    (ValueKind.INTEGER, 4): "I",
    (ValueKind.INTEGER, 8): "Q",
}
_CODES |= {(ValueKind.FLOAT, 4): "f", (ValueKind.FLOAT, 8): "d"}

Piece = tuple[int, int, bytes]
"""Size, alignment in CDR, and content."""


def default_bytes(value: Value, values: Values, *, to_cdr: bool) -> Iterator[Piece]:
    """Yield the pieces of a field's default value.

    Raises:
        NotConvertible: the default in the definition does not fit the type.
    """
    default = _parsed(value)
    if value.form is Form.SEQUENCE:
        elements = default if isinstance(default, list) else []
        yield 4, 4, _U32.pack(len(elements))
        for each in elements:
            yield from _single(value, each, values, to_cdr=to_cdr)
    elif value.form is Form.ARRAY and default is None and value.size:
        yield value.length * value.size, value.alignment, bytes(value.length * value.size)
    elif value.form is Form.ARRAY:
        listed = default if isinstance(default, list) else [None] * value.length
        for each in listed:
            yield from _single(value, each, values, to_cdr=to_cdr)
    else:
        yield from _single(value, default, values, to_cdr=to_cdr)


def _single(value: Value, default: Any, values: Values, *, to_cdr: bool) -> Iterator[Piece]:
    if value.kind is ValueKind.MESSAGE and value.message is not None:
        for field in values.of_fields(value.message).values():
            yield from default_bytes(field, values, to_cdr=to_cdr)
    elif value.kind in (ValueKind.STRING, ValueKind.WIDE_STRING):
        is_wide, text = value.kind is ValueKind.WIDE_STRING, "" if default is None else str(default)
        octets = wide(text) if is_wide else text.encode() + b"\0" * to_cdr
        count = len(octets) // (WIDE_BYTES if is_wide else 1)
        yield 4 + len(octets), 4, _U32.pack(count) + octets
    elif default is None:
        yield value.size, value.alignment, bytes(value.size)
    else:
        yield value.size, value.alignment, _number(value, default)


def _number(value: Value, default: Any) -> bytes:
    code = _CODES[value.kind, value.size]
    try:
        if value.kind is ValueKind.FLOAT:
            return struct.pack(f"<{code}", float(default))
        return struct.pack(f"<{code}", int(default) & ((1 << 8 * value.size) - 1))
    except (ValueError, TypeError, OverflowError) as error:
        raise NotConvertible(f"the default value {default!r} does not fit the field's type") from error


def _parsed(value: Value) -> Any:
    if not value.default:
        return None
    try:
        return load(value.default, "<default value>", angles=False)
    except YamlError as error:
        raise NotConvertible(f"the default value {value.default} is malformed: {error}") from error
