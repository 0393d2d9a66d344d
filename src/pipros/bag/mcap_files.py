"""MCAP files with ROS 1 messages, read and written like bags, by the `mcap` library (`pipros[mcap]`).

The profile is `ros1`: messages are encoded as `ros1`, their definitions are schemas of encoding `ros1msg`,
and a channel's metadata are fields of the connection header (https://mcap.dev/spec/registry).
"""

from __future__ import annotations

import errno
import os
import struct
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

from pipros.bag.connection import Connection
from pipros.bag.errors import BagError, BagFormatError, NoMessages
from pipros.bag.index import ChunkHeader, Stamp
from pipros.bag.layout import Layout
from pipros.bag.reader import BagReader, RawMessage
from pipros.bag.records import Version
from pipros.bag.source import Source
from pipros.limits import Limits, process_limits
from pipros.msg.time import NS_PER_S

MAGIC = b"\x89MCAP0\r\n"
SUFFIX = ".mcap"
_VERSION = Version(0, 0)
_COMPRESSIONS = {"none": "NONE", "lz4": "LZ4", "bz2": "ZSTD", "zstd": "ZSTD"}
_OF_HEADER = ("callerid", "latching", "md5sum", "topic")


def is_mcap(path: str | os.PathLike[str]) -> bool:
    """True for a file that begins as MCAP files do, or a name of one that does not exist yet.

    Raises:
        OSError: the file cannot be read.
    """
    if not os.path.exists(path):
        return os.fspath(path).endswith(SUFFIX)
    with open(path, "rb") as file:
        return file.read(len(MAGIC)) == MAGIC


@contextmanager
def _translated(name: str) -> Iterator[None]:
    """Errors of the library about damaged files as ours."""
    try:
        yield
    except BagError:
        raise
    except OSError as error:
        if error.errno != errno.EINVAL:  # a seek to before the file
            raise
        raise BagFormatError(f"{name} is damaged or cut off") from error
    except Exception as error:
        # The library lets through what struct, lz4 and zstandard raise, besides its own errors.
        if not isinstance(error, struct.error | ValueError | EOFError | RuntimeError | KeyError) and (
            type(error).__module__.partition(".")[0] not in ("mcap", "zstandard", "lz4")
        ):
            raise
        raise BagFormatError(f"{name} is damaged or cut off: {error or type(error).__name__}") from error


def _library() -> Any:
    try:
        import mcap.reader
        import mcap.writer
    except ImportError:
        raise BagError("MCAP files need the mcap library: pip install 'pipros[mcap]'") from None
    return mcap


class McapReader(BagReader):
    """An MCAP file of ROS 1 messages, with the methods of `BagReader`.

    Raises:
        BagError: the library is missing, the file is damaged, or its messages are not of ROS 1.
    """

    def __init__(self, path: str | os.PathLike[str], *, limits: Limits | None = None) -> None:
        self._limits = limits or process_limits()
        library = _library()
        self._owned = Path(path).open("rb")  # noqa: SIM115 # closed by `close`
        try:
            self._source = Source(self._owned, os.fspath(path), self._limits)
            self.layout = Layout(_VERSION)
            self._start()
            self._owned.seek(0)
            with _translated(self._source.name):
                self._mcap = library.reader.SeekingReader(
                    self._owned, record_size_limit=self._limits.bag_chunk_bytes
                )
                self._summary = self._mcap.get_summary()
            if self._summary is None or self._summary.statistics is None:
                raise BagError(f"{self._source.name} has no summary. Run mcap recover")
            for channel in self._summary.channels.values():
                self.layout.connections[channel.id] = self._connection(channel)
        except BaseException:
            self.close()
            raise

    def _connection(self, channel: Any) -> Connection:
        schema = self._summary.schemas.get(channel.schema_id)
        if channel.message_encoding != "ros1" or schema is None or schema.encoding != "ros1msg":
            encoding = "no schema" if schema is None else schema.encoding
            raise BagError(
                f"{self._source.name}: the messages of [{channel.topic}] must be of the encoding ros1 with a "
                f"schema ros1msg, got {channel.message_encoding} with {encoding}"
            )
        header = {"topic": channel.topic, "type": schema.name, **channel.metadata}
        fields = {name: value.encode() for name, value in header.items()}
        fields["message_definition"] = bytes(schema.data)
        if "md5sum" not in fields:
            made = Connection(channel.id, channel.topic, fields)
            fields["md5sum"] = self.class_of(made)._md5sum.encode()
        return Connection(channel.id, channel.topic, fields)

    @property
    def format_name(self) -> str:
        return "mcap"

    @property
    def message_count(self) -> int:
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

    def _stamps(self, which: str) -> list[Stamp]:
        statistics = self._summary.statistics
        if not statistics.message_count:
            raise NoMessages(f"{self._source.name} has no messages")
        time = statistics.message_start_time if which == "start" else statistics.message_end_time
        return [divmod(time, NS_PER_S)]

    def times_by_connection(self) -> dict[int, list[Stamp]]:
        found: dict[int, list[Stamp]] = {}
        for connection, seconds, nanoseconds, *_ in self.raw_messages():
            found.setdefault(connection.id, []).append((seconds, nanoseconds))
        return found

    def raw_messages(
        self,
        connections: Iterable[Connection] | None = None,
        start: Stamp | None = None,
        end: Stamp | None = None,
    ) -> Iterator[RawMessage]:
        wanted = {each.id: each for each in (self.connections if connections is None else connections)}
        if not wanted:
            return
        with _translated(self._source.name):
            for _, channel, message in self._mcap.iter_messages(
                topics={each.topic for each in wanted.values()},
                starting_at=None if start is None else start[0] * NS_PER_S + start[1],
                ending_at=None if end is None else end[0] * NS_PER_S + end[1],
            ):
                connection = wanted.get(channel.id)
                if connection is not None:
                    yield connection, *divmod(message.log_time, NS_PER_S), message.data, 0, message.sequence


class McapWriter:
    """Writes messages into an open file as MCAP; the methods are those of `BagWriter`.

    Args:
        compression: `none`, `lz4` or `zstd`; `bz2`, which MCAP does not have, is `zstd`.
    """

    def __init__(self, file: Any, *, compression: str = "none", chunk_bytes: int = 1024 * 1024) -> None:
        library = _library()
        if compression not in _COMPRESSIONS:
            raise BagError(f"the compression must be one of {', '.join(_COMPRESSIONS)}, got [{compression}]")
        self._file = file
        self.layout = Layout(_VERSION)
        self._writer = library.writer.Writer(
            file,
            chunk_size=max(1, chunk_bytes),
            compression=getattr(library.writer.CompressionType, _COMPRESSIONS[compression]),
        )
        self._writer.start(profile="ros1", library="pipros")
        self._schemas: dict[tuple[str, bytes], int] = {}
        self._channels: dict[int, int] = {}
        self._pending = 0
        self._is_finished = False

    @property
    def size(self) -> int:
        """Bytes of the file, and of what waits for its chunk."""
        return int(self._file.tell())

    def add_connection(self, topic: str, header: Mapping[str, bytes]) -> Connection:
        """As that of `BagWriter`."""
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
        """Adds a serialized message."""
        time = seconds * NS_PER_S + nanoseconds
        self._writer.add_message(self._channels[connection.id], time, data, time)

    def write_message(self, connection: Connection, seconds: int, nanoseconds: int, message: Any) -> None:
        """Adds a message. Raises `SerializationError`, and adds nothing, if a field does not fit."""
        buffer = BytesIO()
        message.serialize(buffer)
        self.write(connection, seconds, nanoseconds, buffer.getvalue())

    def flush(self) -> None:
        """Hands what was written to the operating system; the chunk under way stays in memory."""
        self._file.flush()

    def finish(self) -> None:
        """Writes the summary. May be called twice."""
        if not self._is_finished:
            self._is_finished = True
            self._writer.finish()
            self._file.flush()
