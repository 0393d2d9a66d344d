"""The errors of bags."""

from __future__ import annotations

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable

_TEXT_LIMIT = 2_000


class BagError(PiprosError):
    """A bag cannot be read or written as requested. Quoted parts of the file are made printable."""

    def __init__(self, text: str = "") -> None:
        super().__init__(printable(text, _TEXT_LIMIT))


class BagFormatError(BagError):
    """The bytes of a file violate the format of bags. The text names the place."""


class NotIndexed(BagError):
    """A bag has no index: its writer was killed. `rosbag reindex` makes one."""


class NoMessages(BagError):
    """The start or end of a bag without messages was requested."""
