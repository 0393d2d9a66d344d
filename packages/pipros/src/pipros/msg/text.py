"""YAML-like text form of messages, as in `print(msg)` and `rostopic echo`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from pipros.msg.fields import HasFields, is_message
from pipros.msg.time import Time, TVal

FieldFilter = Callable[[Any], Iterable[str]]

_PLAIN_LIMIT = 70
"""Maximum length of a string that is quoted without the YAML library, which may fold longer strings."""


def strify_message(
    val: Any,
    indent: str = "",
    time_offset: Time | None = None,
    current_time: Time | None = None,  # noqa: ARG001 # part of genpy's signature; it has no effect
    field_filter: FieldFilter | None = None,
    fixed_numeric_width: int | None = None,
) -> str:
    """Format a message, or any value that a field may have.

    Args:
        val: the value.
        indent: the prefix of every line. If it is not empty, a message starts on a new line.
        time_offset: time that is subtracted from all times, which are then written as durations.
        field_filter: function that returns the names of the message fields to write.
        fixed_numeric_width: the width to which integers are padded and floats are truncated.
    """
    return _Text(time_offset, field_filter, fixed_numeric_width).of(val, indent)


class _Text:
    __slots__ = ("_field_filter", "_time_offset", "_width")

    def __init__(self, time_offset: Time | None, field_filter: FieldFilter | None, width: int | None) -> None:
        self._time_offset = time_offset
        self._field_filter = field_filter
        self._width = width

    def of(self, value: Any, indent: str) -> str:
        kind = type(value)
        if kind in (int, float, bool):
            return self._number(value)
        if isinstance(value, str):
            return _quoted(value)
        if isinstance(value, TVal):
            return self._time(value, indent)
        if kind in (list, tuple):
            return self._array(value, indent)
        if is_message(value):
            return self._message(value, indent)
        return str(value)

    def _number(self, value: float) -> str:
        width = self._width
        if width is None or type(value) is bool:
            return str(value)
        if type(value) is int:
            return f"%{width}d" % value
        text = f"%.{width}f" % value
        return text[: max(text.find("."), width)]

    def _time(self, value: TVal, indent: str) -> str:
        if self._time_offset is not None and isinstance(value, Time):
            value = value - self._time_offset
        if self._width is None:
            secs, nsecs = str(value.secs), f"{value.nsecs:9d}"
        else:
            secs, nsecs = (f"%{self._width}d" % part for part in (value.secs, value.nsecs))
        return f"\n{indent}secs: {secs}\n{indent}nsecs: {nsecs}"

    def _array(self, values: list[Any] | tuple[Any, ...], indent: str) -> str:
        if not values:
            return "[]"
        kind = type(values[0])
        if kind in (int, float, bool):
            if self._width is None or kind is bool:
                return str(list(values))
            return "[" + ", ".join(self.of(value, indent) for value in values) + "]"
        if isinstance(values[0], str):
            return _string_list(list(values), indent)
        return "\n" + "\n".join(f"{indent}- {self.of(value, indent + '  ')}" for value in values)

    def _message(self, message: HasFields, indent: str) -> str:
        shown = message.__slots__ if self._field_filter is None else list(self._field_filter(message))
        lines = [
            f"{indent}{name}: {self.of(_readable(getattr(message, name), kind), '  ' + indent)}"
            for name, kind in zip(message.__slots__, message._slot_types, strict=False)
            if name in shown
        ]
        return ("\n" if indent else "") + "\n".join(lines)


def _readable(value: Any, kind: str) -> Any:
    """Return the value of a field, with the octets in a `uint8[]` field as integers.

    As in genpy, the octets in a `char[]` field stay bytes.
    """
    if "uint8[" in kind:
        if isinstance(value, bytes | bytearray):
            return list(value)
        if isinstance(value, str):
            return [ord(character) for character in value]
    return value


def _quoted(text: str) -> str:
    if not text:
        return "''"
    is_plain = text.isascii() and text.isprintable() and '"' not in text and "\\" not in text
    if is_plain and len(text) <= _PLAIN_LIMIT:
        return f'"{text}"'
    import yaml

    quoted: str = yaml.dump(text, default_style='"')
    return quoted.rstrip("\n")


def _string_list(texts: list[str], indent: str) -> str:
    import yaml

    listing: str = yaml.dump(texts)
    listing = listing.rstrip("\n")
    if listing.startswith("["):
        return listing
    return "\n" + "\n".join(f"{indent}{line}" for line in listing.splitlines())
