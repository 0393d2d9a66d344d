"""Write bags in format 2.0. If the writer is killed, at most the open chunk is lost.

A chunk is built in memory, and is written together with its index. The position of the file's index is
written to the file header last. Until then, the file has no index, but `rosbag reindex` can restore its
complete chunks.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Mapping
from io import BytesIO
from itertools import chain, islice
from struct import Struct
from typing import Any

from pipros.msg.time import NS_PER_S
from pipros_tools.bag.compression import NONE, compress
from pipros_tools.bag.connection import Connection, connection_record
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.index import ChunkInfo, chunk_header_bytes, chunk_info_record, index_record
from pipros_tools.bag.layout import BagLayout
from pipros_tools.bag.records import (
    ENTRY,
    LEAST_HEADER_END,
    MAGIC,
    U32,
    Op,
    Version,
    field_bytes,
    file_header,
)
from pipros_tools.bag.sinks import WritableFile

CHUNK_BYTES = 768 * 1024
"""Default uncompressed size at which a chunk ends."""

_TIME_AND_SIZE = Struct("<III")
_LARGEST = 0xFFFFFFFF
_RECORDS_AT_ONCE = 500
"""Number of index records that are written in one call."""

_FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


_KEPT_BYTES = 8 * 1024 * 1024
"""The memory of a chunk of up to this size is used again, because new memory takes as long as compression."""


class _WrittenTopic:
    """The prefix of a connection's message records, and the connection's index entries in the open chunk."""

    __slots__ = ("entries", "is_sorted", "last_ns", "start")

    def __init__(self, connection: Connection) -> None:
        fields = [("op", bytes([Op.MESSAGE])), ("conn", U32.pack(connection.id))]
        self.start = U32.pack(38) + field_bytes(fields) + U32.pack(13) + b"time="
        self.entries = bytearray()
        self.last_ns = 0
        self.is_sorted = True


class BagWriter:
    """Writer of messages to an open file, which the caller must close. Not thread-safe.

    Args:
        file: a binary file open for reading and writing.
        compression: `none`, `bz2` or `lz4`. A later change applies to all chunks that are not yet written.
        chunk_bytes: a chunk is complete once its uncompressed size exceeds this.
        layout: layout of the bag to append to; None for a new file.

    Raises:
        OSError: the file cannot be written. Every method that writes may raise this error. Complete chunks
            stay readable.
    """

    def __init__(
        self,
        file: WritableFile,
        *,
        compression: str = NONE,
        chunk_bytes: int = CHUNK_BYTES,
        layout: BagLayout | None = None,
    ) -> None:
        self._file = file
        self.compression = compression
        self.chunk_bytes = chunk_bytes
        self._chunk = BytesIO()  # its position is the end of the open chunk
        self._chunk_start_ns: int | None = None
        self._chunk_end_ns = 0
        self._is_finished = False
        if layout is None:
            self.layout = BagLayout(Version(2, 0), end=len(MAGIC))
            self._write_file_header(0)
        else:
            if layout.header_end < LEAST_HEADER_END:
                raise BagError(
                    f"the bag's file header must be at least {LEAST_HEADER_END - len(MAGIC)} bytes long, got "
                    f"{layout.header_end - len(MAGIC)}. Rewrite the bag, for example with rosbag reindex"
                )
            self.layout = layout
            layout.index_position = 0
            # Write the header before truncating, so that readers do not look for the removed index.
            self._write_file_header(0)
            self._file.flush()
            self._file.truncate(layout.end)
            self._file.seek(layout.end)
        # The numbers of unusable connections stay reserved, because chunks have their messages.
        used = chain(self.layout.connections, *(chunk.counts for chunk in self.layout.chunks))
        self._next_id = max(used, default=-1) + 1
        self._topics = {key: _WrittenTopic(value) for key, value in self.layout.connections.items()}

    @property
    def size(self) -> int:
        """The size of the file in bytes, including the uncompressed open chunk."""
        return self.layout.end + self._chunk.tell()

    def add_connection(self, topic: str, header: Mapping[str, bytes]) -> Connection:
        """Add a connection. Its header must contain `type`, `md5sum` and `message_definition`."""
        connection = Connection(self._next_id, topic, dict(header))
        self._next_id += 1
        self.layout.connections[connection.id] = connection
        self._topics[connection.id] = _WrittenTopic(connection)
        self._chunk.write(connection_record(connection))
        return connection

    def write(self, connection: Connection, seconds: int, nanoseconds: int, data: bytes) -> None:
        """Add a serialized message."""
        chunk = self._chunk
        offset = chunk.tell()
        topic = self._topics[connection.id]
        chunk.write(topic.start + _TIME_AND_SIZE.pack(seconds, nanoseconds, len(data)))
        chunk.write(data)
        self._added(topic, seconds, nanoseconds, offset)

    def write_message(self, connection: Connection, seconds: int, nanoseconds: int, message: Any) -> None:
        """Serialize a message into the open chunk.

        Raises:
            genpy.SerializationError: a value does not fit its field. Nothing is added.
        """
        chunk = self._chunk
        offset = chunk.tell()
        topic = self._topics[connection.id]
        begin = offset + chunk.write(topic.start + _TIME_AND_SIZE.pack(seconds, nanoseconds, 0))
        try:
            message.serialize(chunk)
        except BaseException:
            chunk.seek(offset)
            chunk.truncate()
            raise
        U32.pack_into(chunk.getbuffer(), begin - 4, chunk.tell() - begin)
        self._added(topic, seconds, nanoseconds, offset)

    def _added(self, topic: _WrittenTopic, seconds: int, nanoseconds: int, offset: int) -> None:
        topic.entries += ENTRY.pack(seconds, nanoseconds, offset)
        time_ns = seconds * NS_PER_S + nanoseconds
        if time_ns < topic.last_ns:
            topic.is_sorted = False
        topic.last_ns = time_ns
        if self._chunk_start_ns is None:
            self._chunk_start_ns = self._chunk_end_ns = time_ns
        elif time_ns > self._chunk_end_ns:
            self._chunk_end_ns = time_ns
        elif time_ns < self._chunk_start_ns:
            self._chunk_start_ns = time_ns
        if self._chunk.tell() > self.chunk_bytes:
            self.finish_chunk()

    def finish_chunk(self) -> None:
        """Write the open chunk.

        Raises:
            BagError: the chunk is larger than the format allows, or the compression is not available.
            OSError: the chunk cannot be written completely. It is kept, and the next call tries again.
        """
        if self._chunk_start_ns is None:
            return
        size = self._chunk.tell()
        if size > _LARGEST:
            raise BagError(f"a chunk must be at most {_LARGEST} bytes long, got {size}")
        with self._chunk.getbuffer() as buffer, buffer[:size] as content:
            data = compress(self.compression, content)
            start = chunk_header_bytes(self.compression, size, len(data))
            index, counts = self._chunk_index()
            position = self.layout.end
            self._file.seek(position)
            self._file.write(start)
            self._file.write(data)
            self._file.write(index)
            self._file.flush()  # Python's buffer would be lost if the process were killed
            end = position + len(start) + len(data) + len(index)
        self.layout.end = end
        self.layout.chunks.append(ChunkInfo(position, self._chunk_start_ns, self._chunk_end_ns, counts))
        self._new_chunk()

    def _new_chunk(self) -> None:
        if self._chunk.tell() > _KEPT_BYTES:
            self._chunk = BytesIO()
        self._chunk.seek(0)
        self._chunk_start_ns = None
        for topic in self._topics.values():
            if topic.entries:
                topic.entries = bytearray()
                topic.is_sorted, topic.last_ns = True, 0

    def _chunk_index(self) -> tuple[bytes, dict[int, int]]:
        records, counts = [], {}
        for connection, topic in self._topics.items():
            if not topic.entries:
                continue
            entries = bytes(topic.entries)
            if not topic.is_sorted:
                entries = b"".join(ENTRY.pack(*entry) for entry in sorted(ENTRY.iter_unpack(entries)))
            counts[connection] = len(entries) // ENTRY.size
            records.append(index_record(connection, entries))
        return b"".join(records), counts

    def flush(self) -> None:
        """Write the open chunk, and flush the file to the operating system."""
        self.finish_chunk()
        self._file.flush()

    def finish(self) -> None:
        """Write the index, which completes the bag. May be called repeatedly.

        No messages may be added afterwards.
        """
        if self._is_finished:
            return
        self.finish_chunk()
        self._write_index()

    def finish_with_what_fits(self) -> int:
        """Write the index. If the disk is full, discard the newest messages until the index fits.

        Return the number of discarded messages. Needs an unbuffered file, such as `WholeWrites`.

        Raises:
            OSError: writing fails for another reason, or even the index of an empty bag does not fit.
        """
        try:
            self.finish()
        except OSError as error:
            if error.errno not in _FULL:
                raise
        else:
            return 0
        lost = sum(len(topic.entries) for topic in self._topics.values()) // ENTRY.size
        self._new_chunk()
        layout = self.layout
        needed = sum(map(len, self._index_records()))
        freed_to = layout.end
        while True:
            self._file.truncate(layout.end)
            try:
                self._write_index()
            except OSError as error:
                if error.errno not in _FULL or not layout.chunks:
                    raise
            else:
                return lost
            while layout.chunks and freed_to - layout.end < needed:
                chunk = layout.chunks.pop()
                lost += sum(chunk.counts.values())
                layout.end = chunk.position
            freed_to = layout.end

    def _index_records(self) -> Iterator[bytes]:
        layout = self.layout
        return chain(
            map(connection_record, layout.connections.values()), map(chunk_info_record, layout.chunks)
        )

    def _write_index(self) -> None:
        position = self.layout.end
        self._file.seek(position)
        records = self._index_records()
        while some := b"".join(islice(records, _RECORDS_AT_ONCE)):
            self._file.write(some)
        self._file.flush()
        self._write_file_header(position)
        self._file.seek(0, os.SEEK_END)
        self._file.flush()
        self.layout.index_position = position
        self._is_finished = True

    def _write_file_header(self, index_position: int) -> None:
        counts = len(self.layout.connections), len(self.layout.chunks)
        end = self.layout.header_end
        header = file_header(index_position, *counts if index_position else (0, 0), end)
        self._file.seek(0)
        self._file.write(MAGIC + header)  # one write, so that a killed process leaves no partial header
        self.layout.end = max(self.layout.end, end)
