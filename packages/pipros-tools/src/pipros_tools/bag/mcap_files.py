"""Read and write MCAP files with ROS 1 messages as if they were bags.

Needs the `mcap` library (`pipros[mcap]`).

The profile is `ros1`: messages have the encoding `ros1`, their definitions are schemas with the encoding
`ros1msg`, and a channel's metadata contains the fields of the connection header
(https://mcap.dev/spec/registry).
"""

from __future__ import annotations

import errno
import os
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from io import BytesIO
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.extras import install_command
from pipros.basics.limits import Limits
from pipros.basics.printable import listed
from pipros.msg.class_finder import ClassFinder
from pipros.msg.time import NS_PER_S
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError, BagFormatError, NoMessages, NotIndexed
from pipros_tools.bag.index import ChunkHeader
from pipros_tools.bag.layout import REPAIR, BagLayout
from pipros_tools.bag.mcap_messages import McapMessages
from pipros_tools.bag.mcap_records import (
    ATTACHMENT,
    DATA_END,
    FOOTER,
    MAGIC,
    METADATA,
    McapSummary,
    parsed,
    read_summary,
    records,
)
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.records import Version
from pipros_tools.bag.sinks import mcap_sink
from pipros_tools.bag.source import Source

_VERSION = Version(0, 0)
COMPRESSIONS = {"none": "NONE", "lz4": "LZ4", "bz2": "ZSTD", "zstd": "ZSTD"}
AFTER_ALL = 1 << 64
"""A number larger than any timestamp (ns)."""

_IN_SCHEMA = ("type", "message_definition")
_BESIDE = ("attachments", "metadata records", "schemas without a channel")
_OF_ROS2 = "rosbag2"
"""Name of the metadata record that every ROS 2 bag has. It describes the file itself."""
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


def summary_of(source: Source) -> McapSummary:
    """Return the summary of a file. Raise `NotIndexed` if it is missing, damaged or has no statistics."""
    try:
        with translated(source.name):
            summary = read_summary(source)
    except BagFormatError as error:
        raise NotIndexed(f"{error}. {REPAIR}") from error
    if summary is None or summary.statistics is None:
        raise NotIndexed(f"{source.name} has no summary with statistics. {REPAIR}")
    return summary


def count_beside(source: Source, summary: McapSummary) -> dict[str, int]:
    """Return the names and numbers of the records that do not belong to messages."""
    metadata = summary.statistics.metadata_count
    if metadata:
        metadata = sum(kind == METADATA for kind, *_ in _records_beside(source))
    counts = summary.statistics.attachment_count, metadata, len(_unused_schemas(summary))
    return {name: count for name, count in zip(_BESIDE, counts, strict=True) if count}


def copy_beside(source: Source, summary: McapSummary, writer: Any) -> set[str]:
    """Copy these records, if the writer writes MCAP. Return the names of those that the new file stores."""
    from mcap.records import Attachment, Metadata

    target = mcap_sink(writer)
    if target is None:
        return set()
    for kind, position, size in _records_beside(source):
        record_type = Metadata if kind == METADATA else Attachment
        target.add_beside(parsed(record_type, source.read(position, size)))
    for schema in _unused_schemas(summary):
        target.add_beside(schema)
    return set(_BESIDE)


def add_record(writer: Any, record: Any) -> None:
    """Add an attachment, a schema or a metadata record to a writer of the `mcap` library."""
    if hasattr(record, "metadata"):
        writer.add_metadata(record.name, record.metadata)
    elif hasattr(record, "encoding"):
        writer.register_schema(record.name, record.encoding, record.data)
    else:
        times = record.create_time, record.log_time
        writer.add_attachment(*times, record.name, record.media_type, record.data)


def _records_beside(source: Source) -> Iterator[tuple[int, int, int]]:
    from mcap.records import Metadata

    with translated(source.name):
        for kind, position, size in records(source, len(MAGIC)):
            if kind in (DATA_END, FOOTER):
                return
            is_metadata = kind == METADATA and parsed(Metadata, source.data(position, size)).name != _OF_ROS2
            if kind == ATTACHMENT or is_metadata:
                yield kind, position, size


def _unused_schemas(summary: McapSummary) -> list[Any]:
    used = {each.schema_id for each in summary.channels.values()}
    return [schema for number, schema in sorted(summary.schemas.items()) if number not in used]


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


def connection_of(channel: Any, schema: Any, classes: ClassFinder) -> Connection:
    """Convert a channel into a connection. `classes` finds the MD5 sum once for all channels of a type.

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
            fields["md5sum"] = classes.find(schema.name, "", definition)._md5sum.encode()
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
        self._again = self._again and partial(McapReader, os.path.abspath(path), limits=limits)
        try:
            self._summary = summary_of(self.source)
            for channel in self._summary.channels.values():
                schema = self._summary.schemas.get(channel.schema_id)
                try:
                    self.layout.connections[channel.id] = connection_of(channel, schema, self._classes)
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

    def beside(self) -> Mapping[str, int]:
        return count_beside(self.source, self._summary)

    def copy_beside(self, writer: Any) -> set[str]:
        return copy_beside(self.source, self._summary, writer)

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
        where: Callable[[Connection, int], bool] | None = None,
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        wanted = {each.id: each for each in (self.connections if connections is None else connections)}
        if not wanted:
            return
        first, last = start_ns or 0, AFTER_ALL if end_ns is None else end_ns
        with translated(self.source.name):
            for channel, time_ns, data, sequence, published in McapMessages(
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
                connection = wanted[channel]
                if not self._has_valid_time(connection, time_ns):
                    continue
                if where is None or where(connection, time_ns):
                    self._note_origin(time_ns, sequence, published)
                    yield connection, time_ns, data, sequence, published


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
        self.is_mcap = True

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
        header = connection.header
        key = connection.type, bytes(header.get("message_definition", b""))
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(key[0], "ros1msg", key[1])
        kept = (each for each in header.items() if each[0] not in _IN_SCHEMA)
        metadata = {name: value.decode("utf-8", "replace") for name, value in kept}
        channel = self._writer.register_channel(topic, "ros1", self._schemas[key], metadata)
        self._channels[connection.id] = channel
        self.layout.connections[connection.id] = connection
        return connection

    def write(self, connection: Connection, seconds: int, nanoseconds: int, data: bytes) -> None:
        """Add a serialized message."""
        time = seconds * NS_PER_S + nanoseconds
        self._writer.add_message(self._channels[connection.id], time, data, time)

    def write_copy(
        self, connection: Connection, time_ns: int, data: bytes, sequence: int, published_ns: int
    ) -> None:
        """Add a message of another file."""
        channel = self._channels[connection.id]
        self._writer.add_message(channel, time_ns, data, published_ns or time_ns, sequence)

    def write_message(self, connection: Connection, seconds: int, nanoseconds: int, message: Any) -> None:
        """Add a message. If a value does not fit its field, add nothing and raise `SerializationError`."""
        buffer = BytesIO()
        message.serialize(buffer)
        self.write(connection, seconds, nanoseconds, buffer.getvalue())

    def add_beside(self, record: Any) -> None:
        """Add an attachment, a schema or a metadata record."""
        add_record(self._writer, record)

    def flush(self) -> None:
        """Write the open chunk, and flush the file to the operating system."""
        self._writer._Writer__finalize_chunk()  # the library has no public function for this
        self._file.flush()

    def finish(self) -> None:
        """Write the summary. May be called repeatedly."""
        if not self._is_finished:
            self._is_finished = True
            self._writer.finish()
            self._file.flush()
