"""Merge the messages from several bags in time order. Each bag is read chunk by chunk."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import repeat
from operator import itemgetter
from typing import Any

from pipros.msg.time import NS_PER_S, Time
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.reader import BagMessage, BagReader
from pipros_tools.bag.times import Stamp, ns_of

Choice = Callable[[Connection], bool]


def merged_raw(
    bags: Sequence[BagReader],
    where: Choice | None = None,
    start_ns: int | None = None,
    end_ns: int | None = None,
    *,
    as_views: bool = False,
    is_needed: Callable[[int, Connection, int], bool] | None = None,
) -> Iterator[tuple[int, tuple[Connection, int, Any, int, int]]]:
    """Yield pairs of a bag's index and a message, in time order.

    The messages are tuples, as in `BagReader.stored_fields`. Messages with equal timestamps are yielded in
    the order of the bags.

    Args:
        where: function that selects connections; defaults to all connections.
        start_ns, end_ns: earliest and latest timestamp, inclusive.
        as_views: see `BagReader.stored_fields`.
        is_needed: function that selects messages by the bag's index, connection and timestamp (ns) when they
            are next; defaults to all messages.

    Raises:
        BagFormatError: a bag is damaged.
    """
    streams = [
        zip(
            repeat(number),
            bag.stored_fields(
                _chosen(bag, where),
                start_ns,
                end_ns,
                as_views=as_views,
                where=is_needed and partial(is_needed, number),
            ),
        )
        for number, bag in enumerate(bags)
    ]
    return streams[0] if len(streams) == 1 else heapq.merge(*streams, key=lambda item: item[1][1])


def merged(
    bags: Sequence[BagReader],
    where: Choice | None = None,
    start: Stamp | None = None,
    end: Stamp | None = None,
) -> Iterator[BagMessage]:
    """Yield the deserialized messages from all bags in time order.

    `start` and `end` are the earliest and latest timestamp (seconds and nanoseconds), inclusive. See also
    `merged_raw` and `BagReader.messages`.
    """
    streams = [bag.decoded(_chosen(bag, where), ns_of(start), ns_of(end)) for bag in bags]
    for connection, time_ns, message in heapq.merge(*streams, key=itemgetter(1)):
        yield BagMessage(connection.topic, message, Time(*divmod(time_ns, NS_PER_S)), connection)


def _chosen(bag: BagReader, where: Choice | None) -> list[Connection]:
    return [each for each in bag.connections if where is None or where(each)]
