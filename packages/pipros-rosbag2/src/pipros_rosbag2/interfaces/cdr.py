"""Convert messages between CDR and plain values, directly from their ROS 2 definitions.

Commands that show or send single messages use this. The gateway uses `pipros_rosbag2.conversion`, which is
faster, and needs a corresponding ROS 1 type. Messages are dictionaries with the fields in order.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg.language.spec import NUMBERS
from pipros.safe.yaml import YamlError, load
from pipros_rosbag2.interfaces.spec import NO_FIELDS, SIZES, Form, Ros2Field, Ros2Message, Ros2Type

_HEADS: Final = {b"\x00\x00": ">", b"\x00\x01": "<"}
"""Byte orders by representation identifier of plain CDR."""
WIDE_BYTES: Final = 4
"""Size of a UTF-16 code unit of a `wstring` from rmw_fastrtps."""
_RANGES: Final = {
    name: (0, 2 ** (8 * size) - 1)
    if name.startswith("u")
    else (-(2 ** (8 * size - 1)), 2 ** (8 * size - 1) - 1)
    for name, size in SIZES.items()
    if name.lstrip("u").startswith("int")
}
_RANGES["byte"] = _RANGES["char"] = (0, 255)
Lookup = Callable[[str], Ros2Message]


class CdrError(PiprosError):
    """A message cannot be decoded, or a value does not fit the type of its field."""


def decode(payload: bytes | memoryview, message: Ros2Message, lookup: Lookup) -> dict[str, Any]:
    """Return a message's fields.

    Raises:
        CdrError: the payload is malformed.
        NotFound: an embedded type is unknown.
    """
    try:
        return _Reader(bytes(payload), lookup).message(message)
    except (struct.error, UnicodeDecodeError, KeyError) as error:
        raise CdrError(f"a message is not of the type {message.type}: {error}") from None


def encode(values: object, message: Ros2Message, lookup: Lookup) -> bytes:
    """Return a message as CDR. Fields that `values` lacks have their defaults.

    Raises:
        CdrError: a field is unknown, or a value has the wrong type.
        NotFound: an embedded type is unknown.
    """
    writer = _Writer(lookup)
    writer.message(values, message, "")
    return b"\x00\x01\x00\x00" + bytes(writer.data)


def wide(text: str) -> bytes:
    """Return the code units of a `wstring`, without its length."""
    return b"".join(struct.pack("<I", unit) for unit in memoryview(text.encode("utf-16-le")).cast("H"))


class _Reader:
    def __init__(self, payload: bytes, lookup: Lookup) -> None:
        self._order = _HEADS[payload[:2]]
        self._data = payload[4:]
        self._at = 0
        self._lookup = lookup

    def message(self, message: Ros2Message) -> dict[str, Any]:
        found = {field.name: self._field(field.type) for field in message.fields}
        return {} if message.fields == (NO_FIELDS,) else found

    def _field(self, kind: Ros2Type) -> Any:
        if kind.form is Form.SINGLE:
            return self._single(kind)
        count = kind.length if kind.form is Form.ARRAY else self._number("uint32", 1)[0]
        if kind.base in SIZES:
            return list(self._number(kind.base, count))
        if count > len(self._data):
            raise CdrError(f"a sequence of {count} elements does not fit in {len(self._data)} bytes")
        return [self._single(kind) for _ in range(count)]

    def _single(self, kind: Ros2Type) -> Any:
        if kind.base in SIZES:
            return self._number(kind.base, 1)[0]
        if kind.base == "string":
            return self._take(self._number("uint32", 1)[0])[:-1].decode(errors="surrogateescape")
        if kind.base == "wstring":
            units = self._number("uint32", self._number("uint32", 1)[0])
            return struct.pack(f"<{len(units)}H", *units).decode("utf-16-le")
        return self.message(self._lookup(kind.base))

    def _number(self, base: str, count: int) -> tuple[Any, ...]:
        size = SIZES[base]
        if count:  # an empty sequence is not followed by padding
            self._at += -self._at % size
        code = "B" if base in ("byte", "char") else NUMBERS[base]
        return struct.unpack(f"{self._order}{count}{code}", self._take(size * count))

    def _take(self, count: int) -> bytes:
        if count > len(self._data) - self._at:
            raise CdrError(f"the message ends after {len(self._data)} bytes, within a field")
        self._at += count
        return self._data[self._at - count : self._at]


class _Writer:
    def __init__(self, lookup: Lookup) -> None:
        self.data = bytearray()
        self._lookup = lookup

    def message(self, values: object, message: Ros2Message, path: str) -> None:
        if not isinstance(values, Mapping):
            raise CdrError(f"{path or message.type} must be a mapping of fields, got {values!r}")
        known = [] if message.fields == (NO_FIELDS,) else [field.name for field in message.fields]
        unknown = sorted(str(name) for name in values if name not in known)
        if unknown:
            fields = ", ".join(known) or "none"
            raise CdrError(f"{message.type} has no field [{unknown[0]}]; its fields: {fields}")
        for field in message.fields:
            where = f"{path}.{field.name}" if path else field.name
            self._field(values.get(field.name, _default(field)), field.type, where)

    def _field(self, value: object, kind: Ros2Type, path: str) -> None:
        if kind.form is Form.SINGLE:
            self._single(_empty(kind) if value is None else value, kind, path)
            return
        fixed = kind.length if kind.form is Form.ARRAY else None
        items = [None] * (fixed or 0) if value is None else value
        if not isinstance(items, Sequence) or isinstance(items, str):
            raise CdrError(f"{path} must be a list, got {value!r}")
        if (fixed is not None and len(items) != fixed) or (
            kind.form is Form.BOUNDED and len(items) > kind.length
        ):
            least = "" if fixed is not None else "at most "
            raise CdrError(f"{path} must have {least}{kind.length} elements, got {len(items)}")
        if fixed is None:
            self._number(len(items), "uint32", path)
        for item in items:
            self._single(_empty(kind) if item is None else item, kind, path)

    def _single(self, value: object, kind: Ros2Type, path: str) -> None:
        if kind.base in SIZES:
            self._number(value, kind.base, path)
        elif kind.base in ("string", "wstring"):
            self._text(value, kind, path)
        else:
            self.message(value, self._lookup(kind.base), path)

    def _text(self, value: object, kind: Ros2Type, path: str) -> None:
        if not isinstance(value, str):
            raise CdrError(f"{path} must be a text, got {value!r}")
        if kind.string_bound and len(value) > kind.string_bound:
            raise CdrError(f"{path} must have at most {kind.string_bound} characters, got {len(value)}")
        is_wide = kind.base == "wstring"
        text = wide(value) if is_wide else value.encode(errors="surrogateescape") + b"\0"
        self._number(len(text) // (WIDE_BYTES if is_wide else 1), "uint32", path)
        self.data += text

    def _number(self, value: object, base: str, path: str) -> None:
        expected = (bool,) if base == "bool" else (int,) if base in _RANGES else (int, float)
        is_bool = isinstance(value, bool)
        if not isinstance(value, expected) or is_bool != (base == "bool"):
            raise CdrError(f"{path} must be of the type {base}, got {value!r}")
        low, high = _RANGES.get(base, (value, value))
        if not low <= value <= high and value == value:  # not NaN
            raise CdrError(f"{path} must be from {low} to {high}, got {value}")
        self.data += bytes(-len(self.data) % SIZES[base])
        self.data += struct.pack("<" + ("B" if base in ("byte", "char") else NUMBERS[base]), value)


def _empty(kind: Ros2Type) -> object:
    if kind.base in SIZES:
        return False if kind.base == "bool" else 0
    return "" if kind.base in ("string", "wstring") else {}


def _default(field: Ros2Field) -> object:
    if not field.default:
        return None
    try:
        return load(field.default)
    except YamlError as error:
        raise CdrError(f"{field.name} has an invalid default: {error}") from None
