"""MCAP files with changed summaries or chunks, for tests."""

import io
from collections.abc import Callable, Iterable
from typing import Any

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, ChunkIndex, Footer, Message
from mcap.writer import CompressionType, Writer
from std_msgs.msg import String

from pipros_tools.bag.mcap_records import MAGIC, McapSummary, read_summary
from pipros_tools.bag.source import Source


def mcap_bytes(times: Iterable[int], *, chunk_bytes: int = 1 << 20) -> bytes:
    """Return an uncompressed file with one channel that has messages at these times in ns."""
    file = io.BytesIO()
    writer: Any = Writer(file, chunk_size=chunk_bytes, compression=CompressionType.NONE)
    writer.start(profile="ros1", library="x")
    schema = writer.register_schema("std_msgs/String", "ros1msg", String._full_text.encode())
    channel = writer.register_channel("/a", "ros1", schema, {"md5sum": String._md5sum})
    for time in times:
        writer.add_message(channel, time, bytes(4), time)
    writer.finish()
    return file.getvalue()


def with_summary(data: bytes, change: Callable[[McapSummary], object], more: bytes = b"") -> bytes:
    """Return a copy of a file with `more` appended to the data and a summary modified by `change`."""
    summary = read_summary(Source(io.BytesIO(data), "x.mcap"))
    assert summary is not None
    change(summary)
    start = int.from_bytes(data[-28:-20], "little")
    builder: Any = RecordBuilder()
    for record in (*summary.schemas.values(), *summary.channels.values(), *summary.chunk_indexes):
        record.write(builder)
    if summary.statistics is not None:
        summary.statistics.write(builder)
    Footer(summary_start=start + len(more), summary_offset_start=0, summary_crc=0).write(builder)
    return b"".join((data[:start], more, builder.end(), MAGIC))


def messages_record(times: Iterable[int]) -> bytes:
    """Return the records of messages with empty texts, at these times in ns."""
    builder: Any = RecordBuilder()
    for time in times:
        Message(channel_id=1, log_time=time, data=bytes(4), publish_time=time, sequence=0).write(builder)
    return bytes(builder.end())


def chunk_record(content: bytes, *, size: int | None = None, compression: str = "zstd") -> bytes:
    """Return the record of a chunk. `size` is the size that it claims; by default, the real one."""
    builder: Any = RecordBuilder()
    Chunk(
        compression=compression, data=zstandard.compress(content) if compression else content,
        message_start_time=1, message_end_time=2, uncompressed_crc=0,
        uncompressed_size=len(content) if size is None else size,
    ).write(builder)  # fmt: skip
    return bytes(builder.end())


def index_of(position: int, *, start: int = 1, end: int = 2) -> ChunkIndex:
    """Return a chunk index for a summary."""
    return ChunkIndex(
        chunk_length=1, chunk_start_offset=position, compression="", compressed_size=1, message_end_time=end,
        message_index_length=0, message_index_offsets={}, message_start_time=start, uncompressed_size=1,
    )  # fmt: skip
