"""What writers of bags offer, and what they write to."""

from __future__ import annotations

from collections.abc import Mapping
from io import FileIO
from typing import Any, Protocol

from pipros.bag.connection import Connection
from pipros.bag.layout import BagLayout


class WholeWrites(FileIO):
    """Unbuffered file whose `write` writes all bytes or raises `OSError`.

    Python's buffered files retry failed writes on each later call, so that on a full disk, even truncating
    would fail.
    """

    def write(self, data: Any, /) -> int:
        left = memoryview(data).cast("B")
        size = len(left)
        while left:
            left = left[super().write(left) or 0 :]
        return size


class WritableFile(Protocol):
    """The file methods that are used for writing."""

    def write(self, data: Any, /) -> Any: ...
    def seek(self, offset: int, whence: int = ..., /) -> int: ...
    def truncate(self, size: int | None = ..., /) -> int: ...
    def flush(self) -> None: ...


class MessageSink(Protocol):
    """The writer methods that are needed to copy messages; see `BagWriter`."""

    def add_connection(self, topic: str, header: Mapping[str, bytes]) -> Connection: ...
    def write(self, connection: Connection, seconds: int, nanoseconds: int, data: bytes) -> None: ...
    def finish(self) -> None: ...


class MessageWriter(MessageSink, Protocol):
    """The methods shared by the writers of bags and MCAP files; see `BagWriter`."""

    layout: BagLayout

    @property
    def size(self) -> int: ...
    def flush(self) -> None: ...
