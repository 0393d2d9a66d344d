"""Rewrite a bag with another compression, or with a subset of its messages."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from itertools import islice
from typing import Any

from pipros.msg.time import Time
from pipros_tools.bag.chunk_data import read_chunk_data
from pipros_tools.bag.compression import compress
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.index import ChunkInfo, chunk_header_bytes, index_record
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.sinks import MessageSink, copying
from pipros_tools.bag.writer import BagWriter

Progress = Callable[[int], None]
"""Callable that takes the number of uncompressed bytes processed."""

Choice = Callable[[Connection, Callable[[], Any], Time], bool]
"""Callable that returns whether to keep a message.

The arguments are the connection, a function to decode the message, and the timestamp.
"""


def recompress(bag: BagReader, file: Any, compression: str, progress: Progress) -> None:
    """Write a bag with the same chunks but another compression, using one thread per processor.

    The messages of a bag in format 1.2, which has no chunks, are copied in time order, in one thread.

    Raises:
        BagError: the bag is damaged, or the compression is not available.
    """
    writer = BagWriter(file, compression=compression)
    if bag.layout.version.number != 200:
        copy_chosen(bag, writer, None, progress)
        return
    layout = writer.layout
    layout.connections.update(bag.layout.connections)
    workers = os.cpu_count() or 1
    done = 0
    with ThreadPoolExecutor(workers) as threads:
        numbers = iter(range(len(bag.chunks)))
        under_way: deque[tuple[int, int, Future[bytes | memoryview]]] = deque()

        def start(number: int) -> None:
            data = read_chunk_data(bag.source, bag.chunk_header(number))
            under_way.append((number, len(data), threads.submit(compress, compression, data)))

        for number in islice(numbers, workers):
            start(number)
        while under_way:
            number, size, job = under_way.popleft()
            data = job.result()
            for following in islice(numbers, 1):
                start(following)
            chunk = bag.chunks[number]
            index = b"".join(index_record(key, entries) for key, entries in bag.chunk_index(number).items())
            layout.chunks.append(ChunkInfo(layout.end, chunk.start_ns, chunk.end_ns, chunk.counts))
            for part in (chunk_header_bytes(compression, size, len(data)), data, index):
                layout.end += file.write(part)
            done += size
            progress(done)
    writer.finish()


def copy_chosen(
    bag: BagReader,
    writer: MessageSink,
    choice: Choice | None,
    progress: Progress,
    *,
    stored_messages: Iterable[StoredMessage] | None = None,
) -> int:
    """Copy the chosen messages and their connections to a writer, in time order, and finish the writer.

    If `choice` is None, copy all messages. Return the number of copied messages.

    Args:
        stored_messages: the messages to choose from; defaults to all in the bag.
    """
    connections: dict[int, Connection] = {}
    write = copying(writer)
    done = count = 0
    for stored in bag.stored_messages() if stored_messages is None else stored_messages:
        connection, time_ns, data, *origin = stored
        done += len(data)
        progress(done)
        if choice is not None and not choice(connection, partial(bag.decode, stored), Time(0, time_ns)):
            continue
        new = connections.get(connection.id)
        if new is None:
            new = connections[connection.id] = writer.add_connection(connection.topic, connection.header)
        write(new, time_ns, data, *origin)
        count += 1
    for unused in bag.connections if choice is None and stored_messages is None else ():
        if unused.id not in connections:
            writer.add_connection(unused.topic, unused.header)
    writer.finish()
    return count
