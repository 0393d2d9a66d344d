"""Read and write MCAP files with ROS 1 messages as if they were bags.

Needs the `mcap` library (`pipros[mcap]`).

The profile is `ros1`: messages have the encoding `ros1`, their definitions are schemas with the encoding
`ros1msg`, and a channel's metadata contains the fields of the connection header
(https://mcap.dev/spec/registry).
"""

from __future__ import annotations

import errno
import struct
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from typing import Any

from pipros.bag.connection import Connection
from pipros.bag.errors import BagError, BagFormatError, NoMessages, NotIndexed
from pipros.bag.index import ChunkHeader
from pipros.bag.layout import REPAIR, BagLayout
from pipros.bag.mcap_messages import McapMessages
from pipros.bag.mcap_records import read_summary
from pipros.bag.reader import BagReader
from pipros.bag.records import Version
from pipros.basics.errors import PiprosError
from pipros.basics.extras import install_command
from pipros.basics.limits import Limits
from pipros.basics.printable import listed
from pipros.msg.class_finder import ClassFinder
from pipros.msg.time import NS_PER_S

_VERSION = Version(0, 0)
COMPRESSIONS = {"none": "NONE", "lz4": "LZ4", "bz2": "ZSTD", "zstd": "ZSTD"}
AFTER_ALL = 1 << 64
"""A number larger than any timestamp (ns)."""

_OF_HEADER = ("callerid", "latching", "md5sum", "topic")
MAX_CONNECTIONS = 65_535
"""Maximum number of connections in a file: channel ids are 16-bit numbers > 0."""


@contextmanager
def translated(name: str) -> Iterator[None]:
    """Context manager that translates the errors that damaged files cause in `mcap` into `BagFormatError`."""
    try:
        yield
    except BagError:
        raise
    except OSError as error:
        if error.errno != errno.EINVAL:  # a seek to a negative position raises this
            raise
        raise BagFormatError(f"{name} is damaged or truncated") from error
    except Exception as error:
        # Besides its own errors, the library raises errors from struct, lz4 and zstandard.
        if not isinstance(
            error, struct.error | ValueError | OverflowError | EOFError | RuntimeError | KeyError
        ) and (type(error).__module__.partition(".")[0] not in ("mcap", "zstandard", "lz4")):
            raise
        raise BagFormatError(
            f"{name} is damaged or truncated: {str(error) or type(error).__name__}"
        ) from error


def mcap_library() -> Any:
    """Import the `mcap` library. Raise `BagError` if it is not installed."""
    try:
        import mcap.reader
        import mcap.writer
    except ImportError:
        raise BagError(
            f"MCAP files need the mcap library, which is not installed. Try: {install_command('mcap')}"
        ) from None
    return mcap


def connection_of(channel: Any, schema: Any) -> Connection:
    """Convert a channel into a connection.

    Raises:
        BagError: the channel does not carry ROS 1 messages, or their definition is malformed.
    """
    if channel.message_encoding != "ros1" or schema is None or schema.encoding != "ros1msg":
        encoding = "no schema" if schema is None else schema.encoding
        hint = " (ROS 2 messages)" if channel.message_encoding == "cdr" else ""
        raise BagError(
            "the messages must have the encoding ros1 and a schema with the encoding ros1msg, "
            f"got {channel.message_encoding} with {encoding}{hint}"
        )
    header = {"topic": channel.topic, "type": schema.name, **channel.metadata}
    fields = {name: value.encode() for name, value in header.items()}
    fields["message_definition"] = bytes(schema.data)
    if "md5sum" not in fields:
        definition = fields["message_definition"].decode("utf-8", "replace")
        try:
            fields["md5sum"] = ClassFinder().find(schema.name, "", definition)._md5sum.encode()
        except PiprosError as error:
            raise BagError(f"the definition of {schema.name} is broken: {error}") from error
    return Connection(channel.id, channel.topic, fields)


class McapReader(BagReader):
    """Reader for an MCAP file with ROS 1 messages, with the methods of `BagReader`.

    Topics with other messages are skipped, unless there are no others.

    Args:
        path: a path, or a binary file open for reading. `close` closes the file.

    Raises:
        NotIndexed: the file has no readable summary, for example because it is still being written or its
            writer was killed.
        BagError: the library is missing, the file is damaged, or none of its topics has ROS 1 messages.
    """

    def __init__(self, path: Any, *, limits: Limits | None = None) -> None:
        mcap_library()
        super().__init__(path, layout=BagLayout(_VERSION), limits=limits)
        self._owned = self._owned or path
        try:
            try:
                with translated(self.source.name):
                    summary = read_summary(self.source)
            except BagFormatError as error:
                raise NotIndexed(f"{error}. {REPAIR}") from error
            if summary is None or summary.statistics is None:
                raise NotIndexed(f"{self.source.name} has no summary with statistics. {REPAIR}")
            self._summary = summary
            for channel in self._summary.channels.values():
                schema = self._summary.schemas.get(channel.schema_id)
                try:
                    self.layout.connections[channel.id] = connection_of(channel, schema)
                except BagError as error:
                    self.skipped.setdefault(channel.topic, str(error))
            if self.skipped and not self.layout.connections:
                topic, reason = next(iter(self.skipped.items()))
                raise BagError(f"{self.source.name}: no topic can be read; [{listed(topic)}]: {reason}")
        except BaseException:
            self.close()
            raise

    @property
    def format_name(self) -> str:
        return "mcap"

    @property
    def message_count(self) -> int:
        if self.skipped:
            return sum(self.count_by_connection().values())
        return int(self._summary.statistics.message_count)

    def count_by_connection(self) -> dict[int, int]:
        counts = self._summary.statistics.channel_message_counts
        return {key: int(counts.get(key, 0)) for key in self.layout.connections}

    @property
    def chunks(self) -> list[Any]:
        return list(self._summary.chunk_indexes)

    def chunk_header(self, number: int) -> ChunkHeader:
        chunk = self._summary.chunk_indexes[number]
        return ChunkHeader(
            chunk.compression or "none",
            chunk.chunk_start_offset,
            chunk.compressed_size,
            chunk.uncompressed_size,
        )

    @property
    def range_ns(self) -> tuple[int, int]:
        statistics = self._summary.statistics
        if not statistics.message_count:
            raise NoMessages(f"{self.source.name} has no messages")
        return statistics.message_start_time, statistics.message_end_time

    def times_ns(self) -> dict[int, list[int]]:
        found: dict[int, list[int]] = {}
        for connection, time_ns, *_ in self.stored_fields():
            found.setdefault(connection.id, []).append(time_ns)
        return found

    def stored_fields(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        *,
        as_views: bool = False,
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        wanted = {each.id: each for each in (self.connections if connections is None else connections)}
        if not wanted:
            return
        first, last = start_ns or 0, AFTER_ALL if end_ns is None else end_ns
        with translated(self.source.name):
            for channel, time_ns, data, chunk, offset in McapMessages(
                self.source,
                self._summary.chunk_indexes,
                self._limits,
                wanted,
                first,
                last,
                as_views,
                lambda channels, error: self._chunk_left_out(
                    (wanted[each].topic for each in channels), error
                ),
            ):
                if self._has_valid_time(wanted[channel], time_ns):
                    yield wanted[channel], time_ns, data, chunk, offset


class McapWriter:
    """Writer for an MCAP file, with the methods of `MessageWriter`; see `BagWriter`.

    Args:
        compression: `none`, `lz4` or `zstd`. MCAP does not support `bz2`, so `bz2` selects `zstd`.

    Raises:
        BagError: the library is missing, or the compression is unknown.
    """

    def __init__(self, file: Any, *, compression: str = "none", chunk_bytes: int = 1024 * 1024) -> None:
        library = mcap_library()
        if compression not in COMPRESSIONS:
            raise BagError(f"compression must be one of {', '.join(COMPRESSIONS)}, got [{compression}]")
        self._file = file
        self.layout = BagLayout(_VERSION)
        self._writer = library.writer.Writer(
            file,
            chunk_size=max(1, chunk_bytes),
            compression=getattr(library.writer.CompressionType, COMPRESSIONS[compression]),
        )
        self._writer.start(profile="ros1", library="pipros")
        self._schemas: dict[tuple[str, bytes], int] = {}
        self._channels: dict[int, int] = {}
        self._is_finished = False

    @property
    def size(self) -> int:
        """The size of the file in bytes, excluding the open chunk."""
        return int(self._file.tell())

    def add_connection(self, topic: str, header: Mapping[str, bytes]) -> Connection:
        """Add a connection; see `BagWriter.add_connection`.

        Raises:
            BagError: the file already has MAX_CONNECTIONS connections.
        """
        if len(self._channels) >= MAX_CONNECTIONS:
            raise BagError(f"an MCAP file can have at most {MAX_CONNECTIONS} connections")
        connection = Connection(len(self._channels), topic, dict(header))
        key = connection.type, bytes(header.get("message_definition", b""))
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(key[0], "ros1msg", key[1])
        metadata = {name: header[name].decode("utf-8", "replace") for name in _OF_HEADER if name in header}
        channel = self._writer.register_channel(topic, "ros1", self._schemas[key], metadata)
        self._channels[connection.id] = channel
        self.layout.connections[connection.id] = connection
        return connection

    def write(self, connection: Connection, seconds: int, nanoseconds: int, data: bytes) -> None:
        """Add a serialized message."""
        time = seconds * NS_PER_S + nanoseconds
        self._writer.add_message(self._channels[connection.id], time, data, time)

    def write_message(self, connection: Connection, seconds: int, nanoseconds: int, message: Any) -> None:
        """Add a message. If a value does not fit its field, add nothing and raise `SerializationError`."""
        buffer = BytesIO()
        message.serialize(buffer)
        self.write(connection, seconds, nanoseconds, buffer.getvalue())

    def flush(self) -> None:
        """Pass all written chunks to the operating system. The open chunk stays in memory."""
        self._file.flush()

    def finish(self) -> None:
        """Write the summary. May be called repeatedly."""
        if not self._is_finished:
            self._is_finished = True
            self._writer.finish()
            self._file.flush()
