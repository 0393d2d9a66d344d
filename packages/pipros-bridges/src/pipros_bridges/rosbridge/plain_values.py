"""Convert messages to values that can be encoded as JSON, CBOR or BSON.

A converter is created once per type and format. Embedded messages become dictionaries; times become
dictionaries with `secs` and `nsecs`. Numbers, booleans and strings are unchanged, unless `Format` says
otherwise.
"""

from __future__ import annotations

import base64
import struct
from collections.abc import Callable, Mapping
from enum import Enum
from operator import attrgetter
from typing import Any
from weakref import WeakKeyDictionary

from pipros.basics.errors import PiprosError
from pipros.msg.base import Message
from pipros.msg.compile.emitter import python_name
from pipros.msg.language.full_text import specs_from_text
from pipros.msg.language.spec import FLOATS, NUMBERS, OCTETS, TIMES, FieldType, MessageSpec

Convert = Callable[[Any], Any]

_LARGEST_BSON_INTEGER = (1 << 63) - 1

# RFC 8746: tags of little-endian typed arrays.
_TYPED_ARRAYS = {"H": 69, "I": 70, "Q": 71, "b": 72, "h": 77, "i": 78, "q": 79, "f": 85, "d": 86}


class Format(Enum):
    """The format to which values are converted.

    `JSON` keeps NaN and infinities, which strict JSON does not allow; `JSON_NULLS` replaces them with None.
    Byte arrays become base64 text in these two formats, and stay binary in the other formats. `CBOR` packs
    arrays of numbers into typed arrays. `BSON` integers must be less than 2^63.
    """

    JSON = "JSON"
    JSON_NULLS = "JSON with nulls"
    CBOR = "CBOR"
    BSON = "BSON"


class NotRepresentable(PiprosError):
    """The format cannot represent the value of a field."""


class PlainValues:
    """Converters to one format, for any message class."""

    def __init__(self, format: Format, cbor_tag: Callable[[int, bytes], Any] | None = None) -> None:  # noqa: A002
        """Create converters to `format`. For CBOR, `cbor_tag` is the class of tagged values."""
        self._format = format
        self._cbor_tag = cbor_tag
        self._converters: WeakKeyDictionary[type[Message], Convert] = WeakKeyDictionary()

    def of(self, message: Message) -> dict[str, Any]:
        """Convert a message to a dictionary of its fields.

        Raises:
            NotRepresentable: the format cannot represent a value. The error names the field.
        """
        cls = type(message)
        convert = self._converters.get(cls)
        if convert is None:
            specs = specs_from_text(cls._type, cls._full_text)
            convert = self._converters[cls] = self._message(specs[cls._type], specs, {})
        values: dict[str, Any] = convert(message)
        return values

    def _message(
        self, spec: MessageSpec, specs: Mapping[str, MessageSpec], known: dict[str, Convert]
    ) -> Convert:
        names = [python_name(field.name) for field in spec.fields]
        converted = [
            (name, convert)
            for name, field in zip(names, spec.fields, strict=True)
            if (convert := self._field(field.type, specs, known, name)) is not None
        ]
        if not names:
            return lambda _: {}
        if len(names) == 1:
            name, get_one = names[0], attrgetter(names[0])
            if not converted:
                return lambda message: {name: get_one(message)}
            convert_one = converted[0][1]
            return lambda message: {name: convert_one(get_one(message))}
        get = attrgetter(*names)
        if not converted:
            return lambda message: dict(zip(names, get(message), strict=True))

        def convert_all(message: Any) -> dict[str, Any]:
            values = dict(zip(names, get(message), strict=True))
            for name, convert in converted:
                values[name] = convert(values[name])
            return values

        return convert_all

    def _field(
        self, kind: FieldType, specs: Mapping[str, MessageSpec], known: dict[str, Convert], name: str
    ) -> Convert | None:
        """Return the converter of a field, or None if its values need no conversion."""
        if kind.is_array and kind.base in OCTETS:
            return bytes if self._format in (Format.CBOR, Format.BSON) else _base64
        if kind.is_array and kind.base in NUMBERS:
            return self._numbers(kind.base, name)
        single = self._single(kind.base, specs, known, name)
        if not kind.is_array:
            return single
        if single is None:
            return list
        element = single
        return lambda values: [element(value) for value in values]

    def _single(
        self, base: str, specs: Mapping[str, MessageSpec], known: dict[str, Convert], name: str
    ) -> Convert | None:
        if base in TIMES:
            return _time
        if base in FLOATS and self._format is Format.JSON_NULLS:
            return _finite
        if base == "uint64" and self._format is Format.BSON:
            return lambda value: _signed(value, name)
        if base not in specs:
            return None
        if base not in known:
            known[base] = self._message(specs[base], specs, known)
        return known[base]

    def _numbers(self, base: str, name: str) -> Convert:
        code = NUMBERS[base]
        if self._format is Format.CBOR and code in _TYPED_ARRAYS and self._cbor_tag is not None:
            tag, make = _TYPED_ARRAYS[code], self._cbor_tag
            return lambda values: make(tag, struct.pack(f"<{len(values)}{code}", *values))
        if self._format is Format.JSON_NULLS and base in FLOATS:
            return lambda values: [_finite(value) for value in values]
        if self._format is Format.BSON and base == "uint64":
            return lambda values: [_signed(value, name) for value in values]
        return list


def _base64(value: Any) -> str:
    return base64.b64encode(value if isinstance(value, bytes) else bytes(value)).decode("ascii")


def _time(value: Any) -> dict[str, int]:
    return {"secs": value.secs, "nsecs": value.nsecs}


def _finite(value: float) -> float | None:
    return value if value - value == 0.0 else None


def _signed(value: int, name: str) -> int:
    if value > _LARGEST_BSON_INTEGER:
        raise NotRepresentable(f"field {name}: BSON integers must be <= 2^63 - 1, got {value}")
    return value
