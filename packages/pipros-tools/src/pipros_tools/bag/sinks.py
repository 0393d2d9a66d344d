"""What writers of bags offer, and what they write to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import FileIO
from typing import Any, Protocol

from pipros.msg.time import NS_PER_S
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.layout import BagLayout


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


class McapSink(MessageSink, Protocol):
    """A writer of MCAP files, which store more than bags: see `mcap_sink`."""

    def write_copy(
        self, connection: Connection, time_ns: int, data: bytes, sequence: int, published_ns: int
    ) -> None: ...
    def add_beside(self, record: Any) -> None: ...


def mcap_sink(writer: Any) -> McapSink | None:
    """Return a writer if it writes MCAP files: attachments, metadata, sequence numbers, publish times."""
    found: McapSink | None = writer if getattr(writer, "is_mcap", False) else None
    return found


def copying(writer: MessageSink) -> Callable[[Connection, int, bytes, int, int], None]:
    """Return a function that writes a message, which has the values of a `StoredMessage`."""
    mcap = mcap_sink(writer)
    if mcap is not None:
        return mcap.write_copy

    def write(connection: Connection, time_ns: int, data: bytes, _sequence: int, _published_ns: int) -> None:
        writer.write(connection, *divmod(time_ns, NS_PER_S), data)

    return write


class MessageWriter(MessageSink, Protocol):
    """The methods shared by the writers of bags and MCAP files; see `BagWriter`."""

    layout: BagLayout

    @property
    def size(self) -> int: ...
    def flush(self) -> None: ...
