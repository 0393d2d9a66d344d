"""Read a bag's messages in time order, optionally limited to certain topics or a time range.

Opening an indexed bag in format 2.0 reads only its index. Messages are read chunk by chunk, so a bag may be
larger than memory.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.basics.limits import Limits, process_limits
from pipros.msg.class_finder import ClassFinder
from pipros.msg.errors import DeserializationError
from pipros.msg.time import NS_PER_S, Time
from pipros_tools.bag.chunk_messages import fields_of_chunks
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.contents import BagContents
from pipros_tools.bag.errors import BagError, BagFormatError
from pipros_tools.bag.layout import BagLayout, read_layout, read_version
from pipros_tools.bag.message_classes import MessageClasses
from pipros_tools.bag.old_format import scan_old_format
from pipros_tools.bag.records import is_valid_time
from pipros_tools.bag.scan import Progress, scan
from pipros_tools.bag.source import SeekableFile, Source
from pipros_tools.bag.times import Stamp, ns_of, received_at

if TYPE_CHECKING:
    from typing_extensions import Self

    from pipros_tools.bag.message_groups import MessageGroup


class BagMessage(NamedTuple):
    """A message from a bag."""

    topic: str
    message: Any
    time: Time
    connection: Connection


class BagReader(BagContents):
    """A bag open for reading.

    Threads and forked processes may share it; each must use its own iterators. If it was opened by its path,
    it can be pickled: the copy opens the file again. See `Source` for other files.

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
        origins: which of sequence numbers and publish times the messages have that were read so far.
        on_bad_message: called with the topic and the reason for each message that does not match its
            definition, for each connection without a valid definition, and for each damaged chunk, which are
            then left out; None (the default) to raise an error instead.

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
        self._owned: Any = None
        self._message_classes = MessageClasses(self._classes)
        self._again: Callable[[], BagReader] | None = None
        self.origins: dict[str, bool] = {}
        self.skipped: dict[str, str] = {}
        self.skipped_files: dict[str, str] = {}
        self.on_bad_message: Callable[[str, str], object] | None = None
        if isinstance(file, str | os.PathLike):
            name = name or os.fspath(file)
            again = partial(BagReader, os.path.abspath(file), limits=limits, name=name, layout=layout)
            self._again = partial(again, rebuild_index=rebuild_index)
            file = self._owned = open_file(file)
        try:
            source = Source(file, name or str(getattr(file, "name", "<bag>")))
            if layout is None:
                layout = _layout_of(source, rebuild_index, progress)
        except BaseException:
            self.close()
            raise
        self.skipped.update(layout.unusable)
        super().__init__(source, layout)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __reduce__(self) -> tuple[Any, ...]:
        if self._again is None:
            raise TypeError(f"{self.name} must be opened by its path to be pickled")
        return _opened_again, (self._again, self.on_bad_message)

    def beside(self) -> Mapping[str, int]:
        """Return what the file has beside messages, such as attachments, with their numbers."""
        return {}

    def copy_beside(self, writer: Any) -> set[str]:  # noqa: ARG002 # other formats use it
        """Copy what `beside` returns to a writer, if its format can store it. Return the names."""
        return set()

    def _note_origin(self, time_ns: int, sequence: int, published_ns: int) -> None:
        if sequence:
            self.origins["sequence numbers"] = True
        if published_ns != time_ns and published_ns:
            self.origins["publish times"] = True

    def close(self) -> None:
        """Close the file if this reader opened it. May be called repeatedly."""
        if self._owned is not None:
            self._owned.close()

    def class_of(self, connection: Connection) -> Any:
        """Return the class for a connection's messages.

        Raise `BagError` if there is no valid definition of its type.
        """
        return self._message_classes.of(connection, self._first_message)

    def _first_message(self, connection: Connection) -> bytes | None:
        return next((data for _, _, data, *_ in self.stored_fields([connection])), None)

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
        *,
        where: Callable[[Connection, int], bool] | None = None,
    ) -> Iterator[StoredMessage]:
        """Return an iterator over the serialized messages in time order.

        Messages with equal timestamps are ordered by connection in bags, and by position in MCAP files.

        Args:
            connections: connections to read; defaults to all.
            start_ns: earliest timestamp; None for no limit.
            end_ns: latest timestamp, inclusive; None for no limit.
            where: function that selects messages by connection and timestamp (ns); defaults to all. It is
                called when a message is next. A chunk of a bag without selected messages is not read.

        Raises:
            BagFormatError: the iteration reaches a damaged part of the file.
        """
        found = self.stored_fields(connections, start_ns, end_ns, where=where)
        return map(partial(tuple.__new__, StoredMessage), found)

    def stored_fields(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        *,
        as_views: bool = False,
        where: Callable[[Connection, int], bool] | None = None,
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        """Like `stored_messages`, but yield plain tuples, which are faster to create and unpack.

        Named tuples would make reading a bag of `std_msgs/String` 10% slower. If `as_views` is true,
        large messages are views, which are valid until the next message is requested.
        """
        return self._in_chunks(connections, start_ns, end_ns, as_views=as_views, where=where)

    def placed_fields(
        self, connections: Iterable[Connection], start_ns: int | None, end_ns: int | None
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        """Like `stored_fields`, but end with the positions of the chunk in the file and in the chunk."""
        return self._in_chunks(connections, start_ns, end_ns, as_views=False, has_places=True)

    def _in_chunks(
        self,
        connections: Iterable[Connection] | None,
        start_ns: int | None,
        end_ns: int | None,
        **options: Any,
    ) -> Iterator[tuple[Connection, int, Any, int, int]]:
        wanted = list(self.connections if connections is None else connections)
        options["on_damage"] = self._chunk_left_out
        return fields_of_chunks(self, wanted, start_ns, end_ns, self._limits, **options)

    def message_groups(
        self, connections: Sequence[Connection], start_ns: int | None, end_ns: int | None, limit: int
    ) -> Iterator[MessageGroup]:
        """Yield the messages of `stored_fields` in groups, in the same order. Needs numpy.

        Args:
            connections: as for `stored_messages`.
            start_ns: likewise.
            end_ns: likewise.
            limit: approximate maximum size of a group in bytes, which a chunk read as a whole may exceed.

        Raises:
            BagFormatError: the bag is damaged.
        """
        from pipros_tools.bag.message_groups import groups_of

        fields = partial(self.stored_fields, connections, start_ns, end_ns, as_views=True)
        bag = self if type(self).stored_fields is BagReader.stored_fields else None
        return groups_of(bag, connections, start_ns, end_ns, limit, fields)

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
                self._report(connection.topic, f"{received_at(time_ns)}: {error}", error)
                continue
            yield connection, time_ns, message

    def _known_class(self, connection: Connection) -> Any:
        """Return the class for a connection's messages, or None if that is reported to `on_bad_message`."""
        try:
            return self.class_of(connection)
        except BagError as error:
            self._report(connection.topic, str(error), error)
            return None

    def _report(self, topic: str, reason: str, error: PiprosError) -> None:
        """Report what is left out of a topic, or raise the error if nothing is to be left out."""
        if self.on_bad_message is None:
            raise error
        self.on_bad_message(topic, reason)

    def _chunk_left_out(self, topics: Iterable[str], error: BagFormatError) -> None:
        """Report a damaged chunk for each of its topics; see `_report`."""
        for topic in dict.fromkeys(topics):
            self._report(topic, str(error), error)

    def _has_valid_time(self, connection: Connection, time_ns: int) -> bool:
        """Return whether ROS times include a message's; if not, report it as one that cannot be read."""
        if is_valid_time(time_ns):
            return True
        reason = f"timestamps must be from 0 to 2^32 s, got {time_ns} ns"
        error = BagFormatError(f"{self.name}: a message on {connection.topic}: {reason}")
        self._report(connection.topic, reason, error)
        return False

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


def _opened_again(opener: Callable[[], BagReader], on_bad_message: Any) -> BagReader:
    """Return the copy of a pickled reader."""
    bag = opener()
    bag.on_bad_message = on_bad_message
    return bag


def _layout_of(source: Source, rebuild_index: bool, progress: Progress | None) -> BagLayout:
    version, start = read_version(source)
    if version.number in (101, 102):
        return scan_old_format(source, version, start)
    if version.number != 200:
        raise BagFormatError(
            f"{source.name}: bag version must be 1.2 or 2.0, got {version.major}.{version.minor}"
        )
    if rebuild_index:
        return scan(source, start, progress)
    return read_layout(source, start)
