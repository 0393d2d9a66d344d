"""Read the topics of bags as tables."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from fnmatch import fnmatchcase
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits, limit_text, process_limits
from pipros.basics.printable import listed
from pipros.msg.bulk.columns import Column
from pipros.msg.bulk.decode import MalformedMessage, decode
from pipros.msg.bulk.plans import MessagePlan, plan_of
from pipros.msg.time import NS_PER_S
from pipros_data.limits import DataLimits
from pipros_data.moments import Moment, moment_ns
from pipros_data.table import RECEIPT, Table, joined_tables
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError, BagFormatError, NoMessages
from pipros_tools.bag.info import BagInfo, bag_info
from pipros_tools.bag.info_text import info_html
from pipros_tools.bag.merge import merged_raw
from pipros_tools.bag.message_groups import MessageGroup, grouped, joined_groups
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.times import received_at

if TYPE_CHECKING:
    from typing_extensions import Self

TABLE_BATCH_BYTES = 32 * 1024 * 1024
"""Limit: approximate size of the messages in one batch of a table. Beyond it, the batch ends after this
message.
"""

BagPath = str | os.PathLike[str]
_BATCHES = 8
"""Size of the batches from which a table in memory is built, in multiples of `TABLE_BATCH_BYTES`."""
_NAMED = 20
_TOPICS_ONE_BY_ONE = 8
"""Up to this number of topics, reading each one in bulk is faster than one pass, message by message."""
_Groups = Callable[[int], Iterator[MessageGroup]]
Counted = Callable[[int], None]
"""Called with the number of messages that have been read so far."""


class NoSuchTopic(PiprosError, LookupError):
    """No bag contains a topic with this name."""


class Bags:
    """A set of open bags. `bags["/imu"]` is the table of a topic, and iterating yields the topics.

    Threads and forked processes may share it; each must use its own iterators. It can be pickled: the copy
    opens the bags again.

    Attributes:
        readers: the bags, ordered by the times of their first messages.
        on_bad_message: called with the topic and the reason for each message that does not match its
            definition, which is then left out; None (the default) to raise an error instead.
    """

    def __init__(self, readers: Iterable[BagReader], limits: Limits | None = None) -> None:
        self.readers = sorted(readers, key=_range_of)
        self._limits = (limits or process_limits()).of(DataLimits)
        self.on_bad_message: Callable[[str, str], object] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close all bags. Tables that have been read remain valid."""
        for each in self.readers:
            each.close()

    def __repr__(self) -> str:
        left = sum(len(each.skipped) for each in self.readers)
        more = f", {left} left out; info() has the reasons" if left else ""
        return f"<Bags of {', '.join(each.name for each in self.readers)}: {len(self.topics())} topics{more}>"

    def _repr_html_(self) -> str:
        """Return an HTML table of the topics of each bag, for notebooks."""
        return "".join(info_html(bag_info(each, each.name, with_frequencies=True)) for each in self.readers)

    def topics(self, pattern: str | Iterable[str] = "*") -> list[str]:
        """Return the topics that match a pattern such as `/camera/*`, or one of several, sorted."""
        patterns = [pattern] if isinstance(pattern, str) else list(pattern)
        found = {each.topic for bag in self.readers for each in bag.connections}
        return sorted(topic for topic in found if any(fnmatchcase(topic, each) for each in patterns))

    def __getitem__(self, topic: str) -> Table:
        if not isinstance(topic, str):
            raise TypeError(f"bags[topic] needs the name of a topic, got {topic!r}")
        return self.table(topic)

    def __iter__(self) -> Iterator[str]:
        return iter(self.topics())

    def __contains__(self, topic: object) -> bool:
        return topic in self.topics()

    def __len__(self) -> int:
        return len(self.topics())

    def _ipython_key_completions_(self) -> list[str]:
        return self.topics()

    def info(self) -> list[BagInfo]:
        """Return what `rosbag info` prints about each bag: times, sizes, and the topics with their types."""
        return [bag_info(each, each.name) for each in self.readers]

    @property
    def duration(self) -> float:
        """The time from the first message to the last in seconds; 0 if there are no messages."""
        ranges = [each.range_ns for each in self.readers if each.message_count]
        if not ranges:
            return 0.0
        return (max(last for _, last in ranges) - min(first for first, _ in ranges)) / NS_PER_S

    def query(self, sql: str, **options: Any) -> Any:
        """Return the result of an SQL query as a `pyarrow.Table`; see `rosbag query` for the names of tables.

        `options` are passed to `batches`.

        Raises:
            QueryError: the query is not a single SELECT, or fails.
            MissingExtra: duckdb or pyarrow is not installed.
        """
        from tempfile import TemporaryDirectory

        from pipros_data.extras import library
        from pipros_data.sql import Database, queried

        arrow = library("pyarrow", "a query")
        topics = self.topics()
        with TemporaryDirectory(prefix="pipros-query-") as folder, Database(folder, topics) as database:
            empty, *batches = queried(database, sql, topics, lambda topic: self.batches(topic, **options))
            return arrow.Table.from_batches(batches, empty.schema)

    def count(self, topic: str) -> int:
        """Return the number of messages on a topic."""
        counts = ((bag.count_by_connection(), bag.connections_of(topic)) for bag in self.readers)
        return sum(found.get(each.id, 0) for found, connections in counts for each in connections)

    def table(
        self,
        topic: str,
        *,
        start: Moment = None,
        end: Moment = None,
        every: int = 1,
        datetimes: bool = False,
        columns: str | Sequence[str] | None = None,
    ) -> Table:
        """Return the messages of a topic as a table, in order of receipt.

        Args:
            start, end: the earliest and latest time of receipt, inclusive; see `Moment`.
            every: read only every n-th message.
            datetimes: whether to return times as `datetime64[ns]` and durations as `timedelta64[ns]` instead
                of integers (ns).
            columns: the column or columns to keep, besides `_time`; defaults to all.

        Raises:
            KeyError: a message has no field for one of `columns`.
            NoSuchTopic: no bag contains this topic.
            ValueError: `every` is no integer, or less than 1.
            BagError: a message does not match its definition, the topic has several types or definitions, or
                the messages exceed the limit `table_bytes`.
        """
        return self._table(topic, None, start, end, every, datetimes, columns)

    def _table(self, topic: str, groups: _Groups | None, *options: Any) -> Table:
        limit = self._limits.table_bytes
        tables, left = [], limit
        batch = min(limit, _BATCHES * TABLE_BATCH_BYTES)  # a table of one batch is not copied
        for part, table in self._tables(topic, batch, None, *options, groups=groups):
            tables.append(table)
            left -= len(part.data)
            if left < 0:
                raise self._too_large(topic)
        return joined_tables(tables)

    def _too_large(self, topic: str) -> BagError:
        limit = limit_text("table_bytes", self._limits.table_bytes)
        return BagError(
            f"the table of {listed(topic)} is too large: {limit}. Read it in batches, or limit the times, or "
            "read every n-th message"
        )

    def tables(
        self,
        pattern: str | Iterable[str] = "*",
        *,
        start: Moment = None,
        end: Moment = None,
        every: int = 1,
        datetimes: bool = False,
        columns: str | Sequence[str] | None = None,
    ) -> dict[str, Table]:
        """Return the tables of all topics that match a pattern; see `table` for the options and errors.

        Many topics are read in one pass over the bags.
        """
        topics = self.topics(pattern)
        options = start, end, every, datetimes, columns
        if len(topics) <= _TOPICS_ONE_BY_ONE:
            return {topic: self._table(topic, None, *options) for topic in topics}
        found = self._in_one_pass(topics, moment_ns(start), moment_ns(end))
        return {topic: self._table(topic, partial(grouped, found.pop(topic)), *options) for topic in topics}

    def _in_one_pass(
        self, topics: Iterable[str], start: int | None, end: int | None
    ) -> dict[str, list[tuple[Connection, int, bytes, int, int]]]:
        """Return the messages of several topics."""
        found: dict[str, list[tuple[Connection, int, bytes, int, int]]] = {topic: [] for topic in topics}
        left = dict.fromkeys(found, self._limits.table_bytes)
        for _, fields in merged_raw(self.readers, lambda each: each.topic in found, start, end):
            topic = fields[0].topic
            found[topic].append(fields)
            left[topic] -= len(fields[2])
            if left[topic] < 0:
                raise self._too_large(topic)
        return found

    def batches(self, topic: str, *, progress: Counted | None = None, **options: Any) -> Iterator[Table]:
        """Yield the messages of a topic as one or more tables of about `TABLE_BATCH_BYTES` each.

        Memory is bounded by this limit, not by the size of the bags. See `table` for options and errors.
        `progress` is called after each batch with the number of messages read so far.
        """
        for _, table in self._tables(topic, TABLE_BATCH_BYTES, progress, **options):
            yield table

    def asof(
        self,
        topic: str,
        *others: str,
        on: str = "receipt",
        tolerance: float | None = None,
        direction: str = "backward",
        **options: Any,
    ) -> Table:
        """Return the table of a topic, with columns of other topics; see `Table.asof`.

        The names of columns from `/odom` begin with `odom.`. `options` are passed to `table`.
        """
        found = self.table(topic, **options)
        for other in others:
            found = found.asof(self.table(other, **options), on=on, tolerance=tolerance, direction=direction)
        return found

    def with_transform(self, table: Table, target: str, source: str, **options: Any) -> Table:
        """Return the table with the pose of `source` relative to `target` at the time of each row.

        The transforms are read from these bags. See `pipros_data.frames.with_transform` for the columns and
        options: `on`, `gap`, `prefix`.
        """
        from pipros_data.frames import with_transform

        return with_transform(table, self.readers, target, source, **options)

    def to_parquet(self, topic: str, path: BagPath, **options: Any) -> None:
        """Write a topic to a Parquet file, one batch at a time. `options` are passed to `batches`."""
        from pipros_data.files import write_arrow

        write_arrow((each.to_arrow() for each in self.batches(topic, **options)), path, "parquet")

    def connections_of(self, topic: str) -> list[tuple[BagReader, Connection]]:
        """Return the connections of a topic. Raise `NoSuchTopic` if there are none."""
        found = [(bag, each) for bag in self.readers for each in bag.connections_of(topic)]
        if not found:
            for reason in [bag.skipped[topic] for bag in self.readers if topic in bag.skipped]:
                raise NoSuchTopic(f"[{listed(topic)}] is left out: {listed(reason)}")
            known = names_of(self.topics())
            raise NoSuchTopic(f"no bag has the topic [{listed(topic)}]; the topics are {known}")
        return found

    def _tables(
        self,
        topic: str,
        limit: int,
        progress: Counted | None,
        start: Moment = None,
        end: Moment = None,
        every: int = 1,
        datetimes: bool = False,
        columns: str | Sequence[str] | None = None,
        *,
        groups: _Groups | None = None,
    ) -> Iterator[tuple[MessageGroup, Table]]:
        if not isinstance(every, int | np.integer) or every < 1:
            raise ValueError(f"every must be an integer >= 1, got {every}")
        plan = self._plan(topic)
        done = 0
        found = groups(limit) if groups else self._groups(topic, moment_ns(start), moment_ns(end), limit)
        for read in self._parts(found, every, limit):
            part, fields = self._decoded(topic, plan, read, datetimes)
            receipt = part.times.view("M8[ns]") if datetimes else part.times
            table = Table(topic, plan.type, {RECEIPT: receipt, **fields})
            wanted = () if columns is None else [columns] if isinstance(columns, str) else columns
            yield part, table if columns is None else table[list(dict.fromkeys((RECEIPT, *wanted)))]
            done += len(part.times)
            if progress is not None:
                progress(done)

    def _decoded(
        self, topic: str, plan: MessagePlan, part: MessageGroup, datetimes: bool
    ) -> tuple[MessageGroup, dict[str, Column]]:
        """Return the messages that match their definition, and their columns."""
        try:
            return part, decode(plan, part.data, np.cumsum(part.sizes), datetimes=datetimes)
        except MalformedMessage as error:
            if self.on_bad_message is None:
                time = "{}.{:09d}".format(*divmod(int(part.times[error.row]), NS_PER_S))
                raise BagFormatError(f"the message on {listed(topic)} received at {time}: {error}") from None
        bad = dict(_malformed(plan, part, 0))
        for row, reason in bad.items():
            self.on_bad_message(topic, f"{received_at(int(part.times[row]))}: {reason}")
        kept = part.take(np.delete(np.arange(len(part.sizes)), list(bad)))
        return kept, decode(plan, kept.data, np.cumsum(kept.sizes), datetimes=datetimes)

    def _plan(self, topic: str) -> MessagePlan:
        found: dict[str, tuple[str, str, Any]] = {}  # types that were renamed keep their md5sum
        for bag, each in self.connections_of(topic):
            if each.md5sum not in found:
                found[each.md5sum] = (each.type, bag.name, bag.class_of(each)._full_text)
        if len(found) > 1:
            kinds = ", ".join(f"{listed(kind)} ({md5}) in {bag}" for md5, (kind, bag, _) in found.items())
            raise BagError(
                f"all messages on {listed(topic)} must have the same type, got {kinds}; "
                "rosbag filter selects those of one type by m._md5sum"
            )
        kind, _, text = next(iter(found.values()))
        return plan_of(kind, text)

    def _parts(self, groups: Iterable[MessageGroup], every: int, limit: int) -> Iterator[MessageGroup]:
        """Yield every n-th message in batches. If there are none, yield one empty batch."""
        waiting: list[MessageGroup] = []
        size = seen = 0
        is_first = True
        for group in groups:
            some = group if every == 1 else group.take(np.arange(-seen % every, len(group.sizes), every))
            seen += len(group.sizes)
            for each in some.parts(limit):
                if waiting and size + each.bytes > limit:
                    yield joined_groups(waiting)
                    waiting, size, is_first = [], 0, False
                waiting.append(each)
                size += each.bytes
        if waiting or is_first:
            yield joined_groups(waiting)

    def _groups(self, topic: str, start: int | None, end: int | None, limit: int) -> Iterator[MessageGroup]:
        bags = [bag for bag in self.readers if bag.connections_of(topic)]
        ranges = [_range_of(bag) for bag in bags]
        if any(late[0] < early[1] for early, late in pairwise(ranges)):
            merged = merged_raw(bags, lambda each: each.topic == topic, start, end)
            yield from grouped((fields for _, fields in merged), limit)
            return
        for bag in bags:
            wanted = bag.connections_of(topic)
            yield from bag.message_groups(wanted, start, end, limit)


def _malformed(plan: MessagePlan, part: MessageGroup, first: int) -> Iterator[tuple[int, str]]:
    """Yield the number of each message that does not match its definition, counted from `first`.

    The messages are halved until each half is good or a single message.
    """
    count = len(part.sizes)
    try:
        decode(plan, part.data, np.cumsum(part.sizes))
    except MalformedMessage as error:
        if count == 1:
            yield first, str(error)
            return
        for begin, end in ((0, count // 2), (count // 2, count)):
            yield from _malformed(plan, part.take(np.arange(begin, end)), first + begin)


def names_of(topics: Sequence[str]) -> str:
    """Return the names for an error text: at most 20 of them, because a bag may have thousands."""
    more = [f"and {len(topics) - _NAMED} more"] if len(topics) > _NAMED else []
    return ", ".join([*map(listed, topics[:_NAMED]), *more]) or "none"


def _range_of(bag: BagReader) -> tuple[int, int]:
    try:
        return bag.range_ns
    except NoMessages:
        return 0, 0
