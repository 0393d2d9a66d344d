"""Exceptions for bags."""

from __future__ import annotations

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable

_TEXT_LIMIT = 2_000


class BagError(PiprosError):
    """A bag cannot be read or written as requested.

    Unprintable characters in the error text are escaped, because the text may quote the file.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(printable(text, _TEXT_LIMIT))


class BagFormatError(BagError):
    """A file is damaged, violates its format, or exceeds a limit.

    The error text names the position, if it is known.
    """


class UnusableConnection(BagFormatError):
    """The header of a connection is damaged, or names no type. Only this connection cannot be read."""

    def __init__(self, topic: str, text: str) -> None:
        super().__init__(text)
        self.topic = topic


class NotIndexed(BagError):
    """A bag has no readable index, for example because its writer was killed.

    `rosbag reindex` rebuilds the index.
    """


class ClosedBag(BagError, ValueError):
    """The bag is closed, so its messages cannot be read."""


class NoMessages(BagError):
    """The start or end of a bag without messages was requested."""
