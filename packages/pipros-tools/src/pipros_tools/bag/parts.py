"""Copy the messages of several bags to one, or of one bag to several."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack

from pipros_tools.bag.connection import Connection
from pipros_tools.bag.merge import merged_raw
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.rewrite import Progress
from pipros_tools.bag.sinks import MessageSink, MessageWriter, copying


class _Target:
    """A new bag. Connections of a topic that have the same header become one."""

    def __init__(self, writer: MessageSink) -> None:
        self._add, self._write = writer.add_connection, copying(writer)
        self._by_header: dict[tuple[str, frozenset[tuple[str, bytes]]], Connection] = {}
        self._by_source: dict[tuple[int, int], Connection] = {}

    def connection(self, bag: int, connection: Connection) -> Connection:
        """Return the new connection for a connection of a bag."""
        new = self._by_source.get((bag, connection.id))
        if new is None:
            key = connection.topic, frozenset(connection.header.items())
            if key not in self._by_header:
                self._by_header[key] = self._add(connection.topic, connection.header)
            new = self._by_source[bag, connection.id] = self._by_header[key]
        return new

    def write(self, bag: int, connection: Connection, time_ns: int, data: bytes, *origin: int) -> None:
        self._write(self.connection(bag, connection), time_ns, data, *origin)


def merge(bags: Sequence[BagReader], writer: MessageSink, progress: Progress) -> int:
    """Copy the messages of all bags in time order, and finish the writer. Return the number of messages.

    Messages with equal timestamps are in the order of the bags.

    Raises:
        BagFormatError: a bag is damaged.
    """
    target = _Target(writer)
    done = count = 0
    for number, (connection, time_ns, data, *origin) in merged_raw(bags):
        done += len(data)
        progress(done)
        target.write(number, connection, time_ns, data, *origin)
        count += 1
    for number, bag in enumerate(bags):  # also those without messages
        for connection in bag.connections:
            target.connection(number, connection)
    writer.finish()
    return count


def split(
    bag: BagReader,
    open_part: Callable[[int], AbstractContextManager[MessageWriter]],
    part_of: Callable[[int], int],
    progress: Progress,
    *,
    size_bytes: int = 0,
    repeats_latched: bool = False,
) -> int:
    """Copy the messages of a bag to several bags, in time order. Return the number of bags.

    Args:
        open_part: opens the bag with a given number, counted from 0.
        part_of: returns a number for a time in ns; a change of the number starts the next bag.
        size_bytes: a bag ends once it has this size; 0 for no limit.
        repeats_latched: whether each bag begins with the last message of each earlier latching publisher.

    Raises:
        BagFormatError: the bag is damaged.
    """
    done = count = 0
    latched: dict[tuple[str, str], tuple[Connection, bytes]] = {}
    number: int | None = None
    writer: MessageWriter | None = None
    with ExitStack() as stack:
        for connection, time_ns, data, *origin in bag.stored_fields():
            is_full = writer is not None and 0 < size_bytes <= writer.size
            if number != part_of(time_ns) or is_full:
                number = part_of(time_ns)
                if writer is not None:
                    writer.finish()
                    stack.pop_all().close()
                writer = stack.enter_context(open_part(count))
                target, count = _Target(writer), count + 1
                for earlier, kept in latched.values():
                    target.write(0, earlier, time_ns, kept, 0, 0)
            if repeats_latched and connection.is_latching:
                latched[connection.topic, connection.callerid] = connection, data
            done += len(data)
            progress(done)
            target.write(0, connection, time_ns, data, *origin)
        if writer is not None:
            writer.finish()
    return count
