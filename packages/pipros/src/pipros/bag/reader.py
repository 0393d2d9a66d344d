"""Read a bag's messages in time order, optionally limited to certain topics or a time range.

Opening an indexed bag in format 2.0 reads only its index. Messages are read chunk by chunk, so a bag may be
larger than memory.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

from pipros.bag.chunk_data import ChunkStore, are_large
from pipros.bag.connection import Connection, StoredMessage
from pipros.bag.errors import BagError, BagFormatError, NoMessages
from pipros.bag.index import ChunkHeader, ChunkInfo
from pipros.bag.layout import BagLayout, read_chunk_header, read_chunk_index, read_layout, read_version
from pipros.bag.old_format import scan_old_format
from pipros.bag.records import U32, Op, checked_time, field_bytes, op_of, parse_entries, parse_head
from pipros.bag.records import number as number_of
from pipros.bag.runs import Entry, Span, runs_in_time_order, sorted_entries
from pipros.bag.scan import Progress, scan
from pipros.bag.source import SeekableFile, Source
from pipros.basics.limits import Limits, process_limits
from pipros.msg.class_finder import ClassFinder, MissingDefinition
from pipros.msg.errors import DeserializationError
from pipros.msg.language.spec import DefinitionError
from pipros.msg.time import NS_PER_S, Time

if TYPE_CHECKING:
    from typing_extensions import Self

Stamp = tuple[int, int]
"""A timestamp: seconds and nanoseconds."""

_MESSAGE_HEADER_BYTES = 38
"""Size of the message record header that rosbag and rosbag_storage write."""


class BagMessage(NamedTuple):
    """A message from a bag."""

    topic: str
    message: Any
    time: Time
    connection: Connection


class BagReader:
    """A bag open for reading. Not thread-safe.

    Args:
        file: a path, or a seekable binary file open for reading, which the caller must close.
        rebuild_index: whether to scan the whole file instead of reading its index, for bags that are
            truncated, damaged or not indexed. In each chunk that can be decompressed, all messages before the
            first damage are found; `damage` describes the damage.
        progress: called with the byte position while the index is rebuilt.
        limits: defaults to the process-wide limits.
        name: the name to use in error messages; defaults to the file's name.
        layout: connections and chunks, if they are known already; by default, they are read from the file.

    Raises:
        BagError: the file is not a bag, has an unsupported version, or is encrypted.
        NotIndexed: the bag has no readable index.
        OSError: the file cannot be read.

    Attributes:
        layout: connections and chunks.
        skipped, skipped_files: map each topic, or file of a bag of several files, that cannot be read to the
            reason. The others are not affected.
        on_bad_message: called with the topic and the reason for each message that does not match its
            definition, and for each connection without a valid definition, which are then left out; None (the
            default) to raise an error instead.

    >>> with BagReader("run.bag") as bag:                              # doctest: +SKIP
    ...     for topic, message, time, _ in bag.messages(["/chatter"]):
    ...         print(time.to_sec(), message.data)
    """

    def __init__(
        self,
        file: str | os.PathLike[str] | SeekableFile,
        *,
        rebuild_index: bool = False,
        progress: Progress | None = None,
        limits: Limits | None = None,
        name: str | None = None,
        layout: BagLayout | None = None,
    ) -> None:
        self._limits = limits or process_limits()
        self._classes = ClassFinder()
        self._chunk_headers: dict[int, ChunkHeader] = {}
        self._owned: Any = None
        self.skipped: dict[str, str] = {}
        self.skipped_files: dict[str, str] = {}
        self.on_bad_message: Callable[[str, str], object] | None = None
        if isinstance(file, str | os.PathLike):
            name = name or os.fspath(file)
            file = self._owned = Path(file).open("rb")  # noqa: SIM115 # closed by `close`
        try:
            self._source = Source(file, name or str(getattr(file, "name", "<bag>")), self._limits)
            self.layout = self._read_layout(rebuild_index, progress) if layout is None else layout
        except BaseException:
            self.close()
            raise

    def _read_layout(self, rebuild_index: bool, progress: Progress | None) -> BagLayout:
        version, start = read_version(self._source)
        if version.number in (101, 102):
            return scan_old_format(self._source, version, start)
        if version.number != 200:
            raise BagFormatError(
                f"{self._source.name}: bag version must be 1.2 or 2.0, got {version.major}.{version.minor}"
            )
        if rebuild_index:
            return scan(self._source, start, self._limits, progress)
        return read_layout(self._source, start)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file if this reader opened it. May be called repeatedly."""
        if self._owned is not None:
            self._owned.close()

    @property
    def name(self) -> str:
        return self._source.name

    @property
    def format_name(self) -> str:
        """The format version, as displayed by `rosbag info`: `2.0`."""
        return f"{self.layout.version.major}.{self.layout.version.minor}"

    @property
    def source(self) -> Source:
        """The file, for random access."""
        return self._source

    @property
    def size(self) -> int:
        """The size of the file in bytes."""
        return self._source.size

    @property
    def damage(self) -> list[str]:
        """Descriptions of the damage found while scanning the file, one for each damaged position."""
        return self.layout.damage

    @property
    def connections(self) -> list[Connection]:
        """All connections, in file order."""
        return list(self.layout.connections.values())

    @property
    def chunks(self) -> list[ChunkInfo]:
        return self.layout.chunks

    @property
    def message_count(self) -> int:
        return sum(sum(chunk.counts.values()) for chunk in self.layout.chunks)

    def count_by_connection(self) -> dict[int, int]:
        """Return the number of messages in each connection, by connection number."""
        counts = dict.fromkeys(self.layout.connections, 0)
        for chunk in self.layout.chunks:
            for connection, count in chunk.counts.items():
                counts[connection] = counts.get(connection, 0) + count
        return counts

    @property
    def start(self) -> Stamp:
        """Timestamp of the first message: seconds and nanoseconds.

        Raises:
            NoMessages: the bag is empty.
        """
        return divmod(self.range_ns[0], NS_PER_S)

    @property
    def end(self) -> Stamp:
        """Timestamp of the last message. Raises `NoMessages` if the bag is empty."""
        return divmod(self.range_ns[1], NS_PER_S)

    @property
    def range_ns(self) -> tuple[int, int]:
        """Timestamps (ns) of the first and last message. Raises `NoMessages` if the bag is empty."""
        filled = [chunk for chunk in self.layout.chunks if chunk.counts]
        if not filled:
            raise NoMessages(f"{self._source.name} has no messages")
        return min(chunk.start_ns for chunk in filled), max(chunk.end_ns for chunk in filled)

    def chunk_header(self, number: int) -> ChunkHeader:
        """Return the header of the chunk with the given index in `chunks`.

        Raises:
            BagFormatError: the header is damaged.
        """
        header = self._chunk_headers.get(number)
        if header is None:
            position = self.layout.chunks[number].position
            header = self._chunk_headers[number] = read_chunk_header(self._source, self.layout, position)
        return header

    def chunk_index(self, number: int) -> Mapping[int, bytes]:
        """Return a chunk's packed index entries by connection number.

        Raise `BagFormatError` if the entries are damaged.
        """
        chunks = self.layout.chunks
        end = chunks[number + 1].position if number + 1 < len(chunks) else self._source.size
        return read_chunk_index(self._source, self.layout, chunks[number], self.chunk_header(number), end)

    def times(self, connections: Iterable[Connection]) -> list[Stamp]:
        """Return the timestamps of all messages in the connections, in time order."""
        found = self.times_by_connection()
        return sorted(stamp for connection in connections for stamp in found.get(connection.id, ()))

    def times_by_connection(self) -> dict[int, list[Stamp]]:
        """Return the timestamps (s, ns) of all messages by connection number, in file order."""
        return {key: [divmod(time, NS_PER_S) for time in times] for key, times in self.times_ns().items()}

    def times_ns(self) -> dict[int, list[int]]:
        """Return the timestamps (ns) of all messages by connection number, in file order."""
        found: dict[int, list[int]] = {}
        for number in range(len(self.layout.chunks)):
            for connection, data in self.chunk_index(number).items():
                found.setdefault(connection, []).extend(time for time, _, _ in parse_entries(data))
        return found

    def class_of(self, connection: Connection) -> Any:
        """Return the class for a connection's messages.

        Raise `BagError` if there is no valid definition of its type.
        """
        kind, topic = connection.type, connection.topic
        try:
            return self._classes.find(kind, connection.md5sum, connection.definition)
        except MissingDefinition:
            raise BagError(
                f"the bag has no definition of {kind} (topic {topic}), and no package has the same definition"
            ) from None
        except DefinitionError as error:
            raise BagError(f"the bag's definition of {kind} (topic {topic}) is broken: {error}") from error

    def raw_messages(
        self,
        connections: Iterable[Connection] | None = None,
        start: Stamp | None = None,
        end: Stamp | None = None,
    ) -> Iterator[tuple[Connection, int, int, bytes, int, int]]:
        """Like `stored_messages`, but take and yield times as seconds and nanoseconds, in plain tuples."""
        for connection, time_ns, *rest in self.stored_fields(connections, ns_of(start), ns_of(end)):
            yield connection, *divmod(time_ns, NS_PER_S), *rest

    def stored_messages(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Iterator[StoredMessage]:
        """Return an iterator over the serialized messages in time order.

        Messages with equal timestamps are ordered by connection in bags, and by position in MCAP files.

        Args:
            connections: connections to read; defaults to all.
            start_ns: earliest timestamp; None for no limit.
            end_ns: latest timestamp, inclusive; None for no limit.

        Raises:
            BagFormatError: the iteration reaches a damaged part of the file.
        """
        return map(partial(tuple.__new__, StoredMessage), self.stored_fields(connections, start_ns, end_ns))

    def stored_fields(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        *,
        as_views: bool = False,
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        """Like `stored_messages`, but yield plain tuples, which are faster to create and unpack.

        Named tuples would make reading a bag of `std_msgs/String` 10% slower. If `as_views` is true,
        large messages are views, which are valid until the next message is requested.
        """
        wanted = self.connections if connections is None else list(connections)
        ranks = {connection.id: rank for rank, connection in enumerate(wanted)}
        spans = self._spans(ranks, start_ns, end_ns)
        order = [span.number for span in sorted(spans, key=lambda span: (span.start_ns, span.number))]
        next_of = {number: at + 1 for at, number in enumerate(order)}
        known = [(connection, *usual_headers(connection.id)) for connection in wanted]
        store = ChunkStore(self._source, self.chunk_header, self._limits)
        left: dict[int, int] = {}  # number of message bytes still allowed in each chunk
        unpack = U32.unpack_from
        try:
            for run in runs_in_time_order(spans, partial(self._sorted_entries, ranks, start_ns, end_ns)):
                number = run.number
                size = self.chunk_header(number).size
                is_view = as_views and are_large(size, len(run.entries))
                upcoming = order[next_of[number] : next_of[number] + 8]
                data = store.get(number, upcoming, is_reusable=is_view)
                content: Any = memoryview(data) if is_view and data is not None else data
                whole = 0 if data is None else len(data)
                chunk_position = self.layout.chunks[number].position
                left_bytes = left.get(number, size)
                entries: Iterable[Entry] = run.entries
                if run.begin or run.end < len(run.entries):
                    entries = islice(run.entries, run.begin, run.end)
                for time_ns, rank, offset in entries:
                    connection, usual, as_in_cpp = known[rank]
                    if data is not None and (
                        data.startswith(usual, offset) or data.startswith(as_in_cpp, offset)
                    ):
                        begin = offset + _MESSAGE_HEADER_BYTES + 8
                        after = begin + unpack(data, begin - 4)[0] if begin <= whole else whole + 1
                        if after > whole:
                            raise self._misplaced(number, offset, "the message is truncated")
                        body = content[begin:after]
                        left_bytes += begin - after
                    else:
                        body = self._message_at(number, data, offset, connection)
                        left_bytes -= len(body)
                    if left_bytes < 0:
                        raise self._misplaced(number, offset, "the messages are larger than their chunk")
                    yield connection, time_ns, body, chunk_position, offset
                left[number] = left_bytes
                if run.is_last:
                    store.drop(number)
                    del left[number]
        finally:
            store.close()

    def _spans(self, ranks: Mapping[int, int], start_ns: int | None, end_ns: int | None) -> list[Span]:
        """Return the chunks that may contain messages of the connections in `ranks` within the period."""
        return [
            Span(number, chunk.start_ns)
            for number, chunk in enumerate(self.layout.chunks)
            if not ranks.keys().isdisjoint(chunk.counts.keys())
            and (start_ns is None or chunk.end_ns >= start_ns)
            and (end_ns is None or chunk.start_ns <= end_ns)
        ]

    def _sorted_entries(
        self, ranks: Mapping[int, int], start_ns: int | None, end_ns: int | None, number: int
    ) -> list[Entry]:
        """Return a chunk's sorted index entries for the connections in `ranks` within the period."""
        index = self.chunk_index(number)
        packed = [(ranks[key], data) for key, data in index.items() if key in ranks]
        entries = sorted_entries(packed, start_ns, end_ns)
        if entries:
            checked_time(entries[-1][0], self._place(number, entries[-1][2]))
        return entries

    def messages(
        self,
        topics: Iterable[str] | str | None = None,
        start: Time | float | None = None,
        end: Time | float | None = None,
        *,
        where: Callable[[Connection], bool] | None = None,
    ) -> Iterator[BagMessage]:
        """Yield deserialized messages in time order.

        Args:
            topics: the topic or topics to read; defaults to all.
            start: earliest timestamp; a number is in seconds.
            end: latest timestamp, inclusive; a number is in seconds.
            where: function that selects connections; defaults to all.

        Raises:
            BagError: the file is damaged, or one of its definitions is missing or malformed.
            DeserializationError: a message's bytes do not match its definition.
        """
        connections = [c for c in self.connections_of(topics) if where is None or where(c)]
        for connection in connections if self.on_bad_message is None else ():
            self.class_of(connection)
        for connection, time_ns, message in self.decoded(connections, ns_of(start), ns_of(end)):
            yield BagMessage(connection.topic, message, Time(*divmod(time_ns, NS_PER_S)), connection)

    def decoded(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Iterator[tuple[Connection, int, Any]]:
        """Like `stored_messages`, but yield the connection, timestamp (ns) and deserialized message.

        Raises the same errors as `messages`.
        """
        classes: dict[int, Any] = {}
        for connection, time_ns, data, _, _ in self.stored_fields(
            connections, start_ns, end_ns, as_views=True
        ):
            if connection.id not in classes:
                classes[connection.id] = self._known_class(connection)
            cls = classes[connection.id]
            if cls is None:
                continue
            try:
                message = cls().deserialize(data)
            except DeserializationError as error:
                if self.on_bad_message is None:
                    raise
                self.on_bad_message(connection.topic, f"{received_at(time_ns)}: {error}")
                continue
            yield connection, time_ns, message

    def _known_class(self, connection: Connection) -> Any:
        """Return the class for a connection's messages, or None if that is reported to `on_bad_message`."""
        try:
            return self.class_of(connection)
        except BagError as error:
            if self.on_bad_message is None:
                raise
            self.on_bad_message(connection.topic, str(error))
            return None

    def decode(self, stored: StoredMessage) -> Any:
        """Deserialize one message; see `messages` for errors."""
        return self.class_of(stored.connection)().deserialize(stored.data)

    __iter__ = messages

    def __getitem__(self, times: slice) -> Iterator[BagMessage]:
        """Return an iterator over the messages between two times, inclusive: `bag[10.5:20]`.

        The times are `Time`, or numbers of seconds.

        Raises:
            TypeError: `times` is not a slice, or has a step.
        """
        if not isinstance(times, slice) or times.step is not None:
            raise TypeError(f"the index must be a slice without a step, such as bag[10.5:20], got {times!r}")
        return self.messages(None, times.start, times.stop)

    def connections_by_topic(self) -> dict[str, list[Connection]]:
        """Return all connections, in file order, by topic."""
        found: dict[str, list[Connection]] = {}
        for connection in self.layout.connections.values():
            found.setdefault(connection.topic, []).append(connection)
        return found

    def connections_of(self, topics: Iterable[str] | str | None) -> list[Connection]:
        """Return the connections for the given topics, or all connections if `topics` is None."""
        if topics is None:
            return self.connections
        wanted = {topics} if isinstance(topics, str) else set(topics)
        return [connection for connection in self.connections if connection.topic in wanted]

    def _message_at(
        self, number: int, data: bytes | bytearray | None, offset: int, connection: Connection
    ) -> bytes:
        """Return a message that has an unusual header, or that is read individually from the file."""
        header = self.chunk_header(number)

        def read(position: int, size: int) -> bytes:
            if position + size > header.size:
                raise self._misplaced(number, offset, "the message does not fit into its chunk")
            if data is not None:
                return bytes(data[position : position + size])
            return self._source.read(header.data_position + position, size)

        where = self._place(number, offset)
        fields, data_position, data_size = parse_head(read, offset, where)
        is_own = "conn" not in fields or number_of(fields, "conn", 4, where) == connection.id
        if op_of(fields, where) != Op.MESSAGE or not is_own:
            raise self._misplaced(number, offset, f"there is no message of {connection.topic}")
        return read(data_position, data_size)

    def _place(self, number: int, offset: int) -> str:
        return f"{self._source.name}, chunk at byte {self.layout.chunks[number].position}, offset {offset}"

    def _misplaced(self, number: int, offset: int, what: str) -> BagFormatError:
        return BagFormatError(
            f"{self._place(number, offset)}: {what}; the index or the chunk is damaged. Try rosbag reindex"
        )


def usual_headers(connection: int) -> tuple[bytes, bytes]:
    """Return the bytes that precede the timestamp in rosbag's and in rosbag_storage's message records."""
    op, conn = ("op", bytes([Op.MESSAGE])), ("conn", U32.pack(connection))
    start, time = U32.pack(_MESSAGE_HEADER_BYTES), U32.pack(13) + b"time="
    return start + field_bytes([op, conn]) + time, start + field_bytes([conn, op]) + time


def received_at(time_ns: int) -> str:
    """Describe a message by its time of receipt, for error messages."""
    return "the message received at {}.{:09d}".format(*divmod(time_ns, NS_PER_S))


def ns_of(time: Time | Stamp | float | None) -> int | None:
    """Convert a time or a number of seconds to a timestamp (ns); if negative, to 0. None stays None."""
    if time is None:
        return None
    if isinstance(time, tuple):
        time = Time(*time)
    elif not isinstance(time, Time):
        time = Time.from_sec(max(0.0, time))
    return time.to_nsec()
