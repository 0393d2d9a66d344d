"""Parse the arguments of `message()`: the mode and the text."""

from __future__ import annotations

import enum
from collections.abc import Sequence


class MessageKind(enum.Enum):
    """The kind of a message, which determines how it is handled."""

    STATUS = "print to standard output"
    NOTICE = "print to standard error"
    WARNING = "print with file and line"
    ERROR = "fail"
    NOTHING = "print nothing"


_KINDS = {
    "STATUS": MessageKind.STATUS,
    "NOTICE": MessageKind.NOTICE,
    "WARNING": MessageKind.WARNING,
    "AUTHOR_WARNING": MessageKind.WARNING,
    "DEPRECATION": MessageKind.WARNING,
    "SEND_ERROR": MessageKind.ERROR,
    "FATAL_ERROR": MessageKind.ERROR,
    "VERBOSE": MessageKind.NOTHING,
    "DEBUG": MessageKind.NOTHING,
    "TRACE": MessageKind.NOTHING,
    "CHECK_START": MessageKind.STATUS,
    "CHECK_PASS": MessageKind.STATUS,
    "CHECK_FAIL": MessageKind.STATUS,
    "CONFIGURE_LOG": MessageKind.NOTHING,
}


def read_message(words: Sequence[str]) -> tuple[MessageKind, str]:
    """Return the kind of the message in `message(words)`, and the text to print."""
    if words and words[0] in _KINDS:
        return _KINDS[words[0]], "".join(words[1:])
    return MessageKind.NOTICE, "".join(words)
