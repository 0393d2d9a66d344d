"""The errors of bags."""

from __future__ import annotations

from pipros.errors import PiprosError
from pipros.printable import printable

_TEXT_LIMIT = 2_000


class BagError(PiprosError):
    """A bag cannot be read or written as asked. What it quotes of the file is made printable."""

    def __init__(self, text: str = "") -> None:
        super().__init__(printable(text, _TEXT_LIMIT))


class BagFormatError(BagError):
    """The bytes of a file break the format of bags. The text names the place."""


class NotIndexed(BagError):
    """A bag has no index: its writer was killed. `rosbag reindex` makes one."""


class NoMessages(BagError):
    """A time was asked of a bag without messages."""
