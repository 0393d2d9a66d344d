"""Parse the arguments of `message()`: the mode and the text."""

from __future__ import annotations

import enum
from collections.abc import Sequence


class Kind(enum.Enum):
    """The kind of a message, which determines how it is handled."""

    STATUS = "print to standard output"
    NOTICE = "print to standard error"
    WARNING = "print with file and line"
    ERROR = "fail"
    NOTHING = "print nothing"


_KINDS = {
    "STATUS": Kind.STATUS,
    "NOTICE": Kind.NOTICE,
    "WARNING": Kind.WARNING,
    "AUTHOR_WARNING": Kind.WARNING,
    "DEPRECATION": Kind.WARNING,
    "SEND_ERROR": Kind.ERROR,
    "FATAL_ERROR": Kind.ERROR,
    "VERBOSE": Kind.NOTHING,
    "DEBUG": Kind.NOTHING,
    "TRACE": Kind.NOTHING,
    "CHECK_START": Kind.STATUS,
    "CHECK_PASS": Kind.STATUS,
    "CHECK_FAIL": Kind.STATUS,
    "CONFIGURE_LOG": Kind.NOTHING,
}


def read_message(words: Sequence[str]) -> tuple[Kind, str]:
    """Return the kind of the message in `message(words)`, and the text to print."""
    if words and words[0] in _KINDS:
        return _KINDS[words[0]], "".join(words[1:])
    return Kind.NOTICE, "".join(words)
