"""Fill messages with a client's values, decoded from JSON or BSON.

Fields without a value are left unchanged. Numbers must match the type: an integer field accepts neither
floats nor booleans, and a boolean field does not accept integers. Errors name the field. The stamp of a
`std_msgs/Header` is set to the current time if it is missing or empty; a time given as `"now"` is also set to
the current time.
"""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.msg.base import Message
from pipros.msg.class_finder import installed_class
from pipros.msg.compile.layout import MESSAGE_VALUES
from pipros.msg.language.spec import FLOATS, INTEGERS, OCTETS, TIMES
from pipros.msg.time import NS_PER_S

Set = Callable[[Any], Any]
"""Converts a client's value to the value of the field. Raises `WrongValue`."""

_HEADERS = frozenset(("std_msgs/Header", "roslib/Header"))
_BITS = {"b": 8, "h": 16, "i": 32, "q": 64}
_RANGES = {
    name: (0, (1 << _BITS[code.lower()]) - 1)
    if code.isupper()
    else (-(1 << _BITS[code] - 1), (1 << _BITS[code] - 1) - 1)
    for name, code in INTEGERS.items()
}
_LARGEST_FLOAT32 = (2 - 2**-24) * 2.0**127
"""Smaller values are rounded to a finite float32."""
_SHOWN = 60


class WrongValue(PiprosError):
    """A value does not fit its field.

    Attributes:
        path: the names on the path to the field, outermost first; array elements have the form `[3]`.
        expected: the type of the field.
        reason: the rule that the value violates.
    """

    def __init__(self, expected: str, reason: str) -> None:
        self.path: list[str] = []
        self.expected = expected
        self.reason = reason
        super().__init__()

    def within(self, step: str) -> WrongValue:
        """Prepend `step`, a field or an index, to the path."""
        self.path.insert(0, step)
        return self

    @property
    def field(self) -> str:
        """The path as a string, such as `pose.position.x` or `points[3].x`."""
        return ".".join(self.path).replace(".[", "[")

    def __str__(self) -> str:
        return f"field {self.field or '(message)'} {self.reason}"


class UnknownField(WrongValue):
    """The message does not have this field."""


class Filler:
    """Fills messages of any class. The clock is read at most once per message."""

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._max_values = MESSAGE_VALUES

    def fill(self, message: Message, values: Any) -> None:
        """Set the fields of `message` from a dictionary, or from a list of the first fields' values.

        Any other value is treated as empty, as in rosbridge. Surplus elements of a list are ignored.

        Raises:
            WrongValue: a value does not fit its field; other fields may have been set already.
        """
        if isinstance(values, list):
            values = dict(zip(message.__slots__, values, strict=False))
        if isinstance(values, dict):
            _Filling(self._now_ns, self._max_values).fill(message, values)


class _Filling:
    """Fills one message."""

    def __init__(self, now_ns: Callable[[], int], max_values: int) -> None:
        self._now_ns = now_ns
        self._max_values = self._values_left = max_values
        self._sizes: dict[type[Message], int] = {}

    @cached_property
    def _now(self) -> tuple[int, int]:
        return divmod(self._now_ns(), NS_PER_S)

    def fill(self, message: Any, values: Mapping[str, Any]) -> None:
        slots = message.__slots__
        kinds = dict(zip(slots, message._get_types(), strict=True))
        if message._type in _HEADERS and values.get("stamp", {}) == {}:
            message.stamp.set(*self._now)
        for name, value in values.items():
            kind = kinds.get(name)
            if kind is None:
                shown = printable(name, _SHOWN)
                known = ", ".join(slots) or "no fields"
                raise UnknownField("", f"does not exist: {message._type} has {known}").within(shown)
            try:
                self._set(message, name, kind, value)
            except WrongValue as error:
                raise error.within(name) from None

    def _set(self, message: Any, name: str, kind: str, value: Any) -> None:
        base, bracket, digits = kind.partition("[")
        if bracket:
            setattr(message, name, self._array(kind, base, digits.rstrip("]"), value))
        elif base in INTEGERS:
            setattr(message, name, _integer(base, value))
        elif base in FLOATS:
            setattr(message, name, _float(base, value))
        elif base == "bool":
            setattr(message, name, _bool(value))
        elif base == "string":
            setattr(message, name, _string(value))
        elif base in TIMES:
            self._fill_time(base, getattr(message, name), value)
        else:
            self._fill_message(base, getattr(message, name), value)

    def _fill_time(self, base: str, time: Any, value: Any) -> None:
        if base == "time" and value == "now":
            time.set(*self._now)
            return
        if not isinstance(value, dict):
            hint = 'an object {"secs": …, "nsecs": …}' + (' or "now"' if base == "time" else "")
            raise WrongValue(base, f"must be {hint}, got {_shown(value)}")
        part_type = "uint32" if base == "time" else "int32"
        for part, number in value.items():
            if part not in ("secs", "nsecs"):
                raise UnknownField(base, f"does not exist: a {base} has secs, nsecs").within(
                    printable(part, _SHOWN)
                )
            try:
                setattr(time, part, _integer(part_type, number))
            except WrongValue as error:
                raise error.within(part) from None

    def _fill_message(self, base: str, message: Any, value: Any) -> None:
        if not isinstance(value, dict):
            raise WrongValue(base, f"must be an object ({base}), got {_shown(value)}")
        self.fill(message, value)

    def _array(self, kind: str, base: str, digits: str, value: Any) -> Any:
        if base in OCTETS and isinstance(value, (str, bytes)):
            made: Any = _octets(kind, value)
        elif not isinstance(value, list):
            text = " or base64 text" if base in OCTETS else ""
            raise WrongValue(kind, f"must be an array ({kind}){text}, got {_shown(value)}")
        else:
            made = value
        if digits and len(made) != int(digits):
            raise WrongValue(kind, f"must have {int(digits)} elements, got {len(made)}")
        return made if isinstance(made, bytes) else self._elements(base, made)

    def _elements(self, base: str, values: list[Any]) -> Any:
        if base in INTEGERS:
            low, high = _RANGES[base]
            if values and not (
                set(map(type, values)) == {int} and min(values) >= low and max(values) <= high
            ):
                values = _each(values, lambda value: _integer(base, value))
            return bytes(values) if base in OCTETS else values
        if base in FLOATS:
            if not (base == "float64" and set(map(type, values)) <= {float}):
                return _each(values, lambda value: _float(base, value))
            return values
        if base == "bool":
            return _each(values, _bool)
        if base == "string":
            return _each(values, _string)
        return _each(values, lambda value: self._element(base, value))

    def _element(self, base: str, value: Any) -> Any:
        if base in TIMES:
            from pipros.msg.time import Duration, Time

            time = Time() if base == "time" else Duration()
            self._fill_time(base, time, value)
            return time
        cls = installed_class(base)
        if cls is None:
            raise WrongValue(base, f"has the type {base}, which is not installed")
        if cls not in self._sizes:
            self._sizes[cls] = _value_count(cls())
        self._values_left -= self._sizes[cls]
        if self._values_left < 0:
            limit = f"the limit is {self._max_values}"
            raise WrongValue(base, f"makes the message too large; {limit}")
        message = cls()
        self._fill_message(base, message, value)
        return message


def _each(values: list[Any], take: Set) -> list[Any]:
    taken = []
    for index, value in enumerate(values):
        try:
            taken.append(take(value))
        except WrongValue as error:
            raise error.within(f"[{index}]") from None
    return taken


def _value_count(value: Any) -> int:
    """Return the number of values in a message, including the message itself."""
    if isinstance(value, Message):
        return 1 + sum(_value_count(getattr(value, name)) for name in value.__slots__)
    return 1 + sum(map(_value_count, value)) if isinstance(value, list) else 1


def _integer(base: str, value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise WrongValue(base, f"must be an integer ({base}), got {_shown(value)}")
    low, high = _RANGES[base]
    if not low <= value <= high:
        raise WrongValue(base, f"must be from {low} to {high} ({base}), got {_shown(value)}")
    return int(value)  # BSON decodes to a subclass of int


def _float(base: str, value: Any) -> float:
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        raise WrongValue(base, f"must be a number ({base}), got {_shown(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    is_finite = number - number == 0.0
    if (base == "float32" and is_finite and abs(number) >= _LARGEST_FLOAT32) or (
        isinstance(value, int) and not is_finite
    ):
        raise WrongValue(base, f"is too large for a {base}: {_shown(value)}")
    return number


def _bool(value: Any) -> bool:
    if type(value) is not bool:
        raise WrongValue("bool", f"must be true or false, got {_shown(value)}")
    return value


def _string(value: Any) -> str:
    if not isinstance(value, str):
        raise WrongValue("string", f"must be a string, got {_shown(value)}")
    if not value.isascii():
        try:
            value.encode()
        except UnicodeEncodeError:
            raise WrongValue(
                "string", "must be a valid Unicode string, but contains an unpaired surrogate"
            ) from None
    return value


def _octets(kind: str, value: str | bytes) -> bytes:
    if isinstance(value, bytes):
        return value
    try:
        return base64.b64decode(value, validate=True)
    except (binascii.Error, ValueError):
        raise WrongValue(kind, f"must be base64 text or an array of numbers ({kind})") from None


def _shown(value: Any) -> str:
    """Return a short description of a value, for error texts."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (dict, list)):
        return "an object" if isinstance(value, dict) else "an array"
    if isinstance(value, int) and value.bit_length() > 200:
        return "a number of more than 60 digits"
    return printable(repr(value), _SHOWN)
