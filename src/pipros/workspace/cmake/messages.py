"""`message()`: what it says, and where."""

from __future__ import annotations

import enum
from collections.abc import Sequence


class Kind(enum.Enum):
    """What is to be done about a message."""

    STATUS = "for standard output"
    NOTICE = "for standard error"
    WARNING = "to be shown with its place"
    ERROR = "ends everything"
    NOTHING = "for nobody"


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
    """What kind of message it is, and its text."""
    if words and words[0] in _KINDS:
        return _KINDS[words[0]], "".join(words[1:])
    return Kind.NOTICE, "".join(words)
