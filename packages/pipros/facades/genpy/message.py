"""`genpy.message`: finds message classes by name, formats messages, and fills them from YAML."""

from __future__ import annotations

import codecs
from typing import Any

from genpy.base import is_simple
from pipros.basics.errors import NotFound
from pipros.msg.base import Message, struct_I
from pipros.msg.check import check_type
from pipros.msg.errors import DeserializationError, MessageException, SerializationError
from pipros.msg.from_yaml import fill_message_args, get_printable_message_args
from pipros.msg.importing.load import load_message_class, load_service_class
from pipros.msg.language.spec import HEADER, TIMES
from pipros.msg.text import strify_message
from pipros.msg.time import Duration, Time, TVal

__all__ = [
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "RosMsgUnicodeErrors",
    "SerializationError",
    "TVal",
    "Time",
    "check_type",
    "fill_message_args",
    "get_message_class",
    "get_printable_message_args",
    "get_service_class",
    "is_simple",
    "isstring",
    "strify_message",
    "struct_I",
]


def isstring(s: object) -> bool:
    """Return whether an object is a string."""
    return isinstance(s, str)


def get_message_class(message_type: str, reload_on_error: bool = False) -> Any:  # noqa: ARG001
    """Return the class of a message type, including `time` and `duration`, or None if it does not exist.

    `reload_on_error` has no effect, because definitions are looked up on each call.

    Raises:
        ValueError: the name lacks a package, or has too many parts.
    """
    return _load(load_message_class, message_type)


def get_service_class(service_type: str, reload_on_error: bool = False) -> Any:  # noqa: ARG001
    """Return the class of a service type, or None if it does not exist. See `get_message_class`."""
    return _load(load_service_class, service_type)


def _load(load: Any, type_name: str) -> Any:
    if type_name in TIMES:
        return Time if type_name == "time" else Duration
    if type_name == "Header":
        type_name = HEADER
    package, _, _ = type_name.rpartition("/")
    if not package:
        raise ValueError(f"message type is missing package name: {type_name}")
    if "/" in package:
        raise ValueError(f"invalid name [{type_name}]")
    try:
        return load(type_name)
    except NotFound:
        return None


class RosMsgUnicodeErrors:
    """The codec error handler `rosmsg`, with which generated modules decode strings.

    Replaces invalid characters, and logs an error once per message type.
    """

    def __init__(self) -> None:
        self.msg_type: str | None = None
        self._reported: set[str | None] = set()

    def __call__(self, error: UnicodeError) -> tuple[str | bytes, int]:
        if self.msg_type not in self._reported:
            self._reported.add(self.msg_type)
            import logging

            what = f"message {self.msg_type}" if self.msg_type else "unknown message"
            logging.getLogger("rosout").error(
                "Characters replaced when decoding %s (will print only once): %s", what, error
            )
        return codecs.replace_errors(error)


codecs.register_error("rosmsg", RosMsgUnicodeErrors())
