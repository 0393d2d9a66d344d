"""Merge the messages of several bags in time order. Memory is bounded by the open chunks of each bag."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Sequence

from pipros.bag.connection import Connection
from pipros.bag.index import Stamp
from pipros.bag.reader import BagMessage, BagReader, RawMessage
from pipros.msg.time import Time

Choice = Callable[[Connection], bool]


def merged_raw(
    bags: Sequence[BagReader],
    where: Choice | None = None,
    start: Stamp | None = None,
    end: Stamp | None = None,
) -> Iterator[tuple[int, RawMessage]]:
    """Yield serialized messages of all bags in time order, each with the number of its bag.

    Messages with equal timestamps are in the order of the bags.

    Args:
        where: selects connections; by default all.
        start, end: first and last timestamp, inclusive.

    Raises:
        BagFormatError: a bag is damaged.
    """

    def of(number: int, bag: BagReader) -> Iterator[tuple[int, RawMessage]]:
        chosen = [each for each in bag.connections if where is None or where(each)]
        for message in bag.raw_messages(chosen, start, end):
            yield number, message

    streams = [of(number, bag) for number, bag in enumerate(bags)]
    return heapq.merge(*streams, key=lambda item: (item[1][1], item[1][2]))


def merged(
    bags: Sequence[BagReader],
    where: Choice | None = None,
    start: Stamp | None = None,
    end: Stamp | None = None,
) -> Iterator[BagMessage]:
    """Yield deserialized messages of all bags; see `merged_raw` and `BagReader.messages`."""
    for number, (connection, seconds, nanoseconds, data, _, _) in merged_raw(bags, where, start, end):
        message = bags[number].class_of(connection)().deserialize(data)
        yield BagMessage(connection.topic, message, Time(seconds, nanoseconds), connection)
