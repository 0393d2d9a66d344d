"""Fill messages from YAML values on command lines and in launch files.

Implements the rules of http://wiki.ros.org/ROS/YAMLCommandLine.
"""

from __future__ import annotations

from collections.abc import Mapping
from io import StringIO
from typing import Any

from pipros.msg.base import Message
from pipros.msg.errors import MessageException
from pipros.msg.language.spec import BUILTINS
from pipros.msg.time import Duration, Time, TVal

_TIME_CLASSES: Mapping[str, type[TVal]] = {"time": Time, "duration": Duration}


def get_printable_message_args(msg: Message, buff: StringIO | None = None, prefix: str = "") -> str:
    """Return the names of all fields that take a value, such as `header.seq`, separated by spaces."""
    buff = StringIO() if buff is None else buff
    for name in msg.__slots__:
        value = getattr(msg, name)
        if isinstance(value, Message):
            get_printable_message_args(value, buff=buff, prefix=f"{prefix}{name}.")
        else:
            buff.write(f"{prefix}{name} ")
    return buff.getvalue().rstrip()


def fill_message_args(msg: Message | TVal, msg_args: Any, keys: Mapping[str, Any] | None = None) -> None:
    """Set the fields of `msg` from a list of all values, or from a list with one dictionary.

    Args:
        msg: changed in place.
        msg_args: the parsed YAML; None means no arguments.
        keys: keywords for message or time fields, such as `now`, with their values.

    Raises:
        MessageException: there are too many or too few values, a field or keyword is unknown, or the value of
            an array field is not a list or has the wrong length. Other values are not checked.
        ValueError: `msg_args`, or the value of a message field, is neither a list nor a dictionary.
    """
    args = [] if msg_args is None else msg_args
    if len(args) == 1 and type(args[0]) is dict:
        args = args[0]
    _Filler(keys or {}).fill(msg, args, "")


class _Filler:
    def __init__(self, keys: Mapping[str, Any]) -> None:
        self._keys = keys

    def fill(self, message: Any, args: Any, prefix: str) -> None:
        if not isinstance(message, Message | TVal):
            raise ValueError(f"msg must be a Message instance: {message}")
        slots = message.__slots__
        if type(args) is dict:
            for name, value in args.items():
                # `name:` with nothing after it, which YAML reads as null, means an empty string.
                self._set(message, name, "" if value is None else value, prefix)
        elif type(args) is list:
            if len(args) != len(slots):
                amount = "Too many" if len(args) > len(slots) else "Not enough"
                raise MessageException(f"{amount} arguments:\n * Given: {args}\n * Expected: {slots}")
            for name, value in zip(slots, args, strict=True):
                self._set(message, name, value, prefix)
        else:
            raise ValueError(f"invalid msg_args type: {args}")

    def _set(self, message: Any, name: str, value: Any, prefix: str) -> None:
        if name not in message.__slots__:
            raise MessageException(f"No field name [{prefix}{name}]{_yaml_hint(name)}")
        present = getattr(message, name)
        if isinstance(present, Message | TVal):
            if type(value) is str:
                if value not in self._keys:
                    raise MessageException(f"No key named [{value}]")
                setattr(message, name, self._keys[value])
            elif isinstance(present, TVal) and type(value) is int:
                setattr(message, name, _time_of_nanoseconds(type(present), value))
            else:
                self.fill(present, value, f"{prefix}{name}.")
        elif type(present) is list:
            self._set_array(message, name, present, value, prefix)
        else:
            setattr(message, name, value)

    def _set_array(self, message: Any, name: str, present: list[Any], value: Any, prefix: str) -> None:
        if type(value) not in (list, tuple):
            raise MessageException(
                f"Field [{prefix}{name}] must be a list or tuple instead of: {type(value).__name__}"
            )
        kind = message._slot_types[message.__slots__.index(name)]
        base, _, length = kind.rstrip("]").partition("[")
        if length and len(value) != int(length):
            raise MessageException(
                f"Field [{prefix}{name}] has incorrect number of elements: {len(value)} != {int(length)}"
            )
        if base in BUILTINS and base not in _TIME_CLASSES:
            setattr(message, name, value)
            return
        present[:] = [self._element(base, element, f"{prefix}{name}", prefix) for element in value]

    def _element(self, base: str, value: Any, field: str, prefix: str) -> Any:
        element = _new_element(base, field)
        if isinstance(element, TVal) and type(value) is int:
            return _time_of_nanoseconds(type(element), value)
        self.fill(element, value, prefix)
        return element


def _time_of_nanoseconds(kind: type[TVal], nanoseconds: int) -> TVal:
    return (Time if issubclass(kind, Time) else Duration).from_sec(nanoseconds / 1e9)


def _new_element(base: str, field: str) -> Message | TVal:
    from pipros.basics.errors import PiprosError
    from pipros.msg.importing.load import load_message_class

    if base in _TIME_CLASSES:
        return _TIME_CLASSES[base]()
    try:
        message_class: type[Message] = load_message_class(base)
        return message_class()
    except PiprosError:
        raise MessageException(
            f"Cannot instantiate messages for field [{field}] : cannot load class {base}"
        ) from None


def _yaml_hint(name: object) -> str:
    """Return an explanation for a key such as `off`, which YAML reads as a boolean.

    For other keys, return an empty string.
    """
    return " (YAML reads on, off, yes and no as booleans: write 'off')" if isinstance(name, bool) else ""
