"""Untrusted MCAP files that would take far more memory or time than their size suggests are refused."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from pipros.basics.limits import Limits
from pipros_tools.bag import BagFormatError, NotIndexed
from pipros_tools.bag.chunk_data import check_chunk
from pipros_tools.bag.index import ChunkHeader
from pipros_tools.bag.mcap_files import McapReader
from pipros_tools.bag.mcap_records import McapSummary
from pipros_tools.bag.mcap_repair import recover
from pipros_tools.bag.source import Source
from tests.support.constants import Constants
from tests.support.mcap import chunk_record, index_of, mcap_bytes, messages_record, with_summary
from tests.support.memory import memory_of

MIB = 1 << 20


def read(data: bytes, limits: Limits | None = None) -> list[int]:
    """Return the times of all messages in ns."""
    reader = McapReader(io.BytesIO(data), limits=limits or Limits())
    return [seconds * 10**9 + nanoseconds for _, seconds, nanoseconds, *_ in reader.raw_messages()]


def appended(*parts: bytes) -> bytes:
    """A file of a message at 0 ns and these chunks, all in the summary."""

    def add(summary: McapSummary) -> None:
        position = summary.chunk_indexes[0].chunk_start_offset + len(chunk)
        for part in parts:
            summary.chunk_indexes.append(index_of(position))
            position += len(part)

    data = mcap_bytes([])
    chunk = chunk_record(messages_record([0]))
    start = int.from_bytes(data[-28:-20], "little")

    def only(summary: McapSummary) -> None:
        summary.chunk_indexes = [index_of(start, start=0, end=0)]
        add(summary)

    return with_summary(data, only, chunk + b"".join(parts))


def test_a_chunk_that_the_summary_names_twice_is_refused() -> None:
    def repeat(summary: McapSummary) -> None:
        summary.chunk_indexes *= 1000

    data = with_summary(mcap_bytes(range(1000)), repeat)

    with memory_of(10 * MIB), pytest.raises(NotIndexed, match=r"lists the chunk at byte \d+ twice"):
        read(data)


def test_chunks_within_each_other_are_refused() -> None:
    inner = chunk_record(messages_record([1] * 100), compression="")
    outer = chunk_record(inner, compression="")
    data = appended(outer)
    position = data.index(inner)

    def add(summary: McapSummary) -> None:
        summary.chunk_indexes.append(index_of(position))

    with pytest.raises(BagFormatError, match=f"the chunk must end before the next one, at byte {position}"):
        read(with_summary(data, add))


def test_a_message_of_a_compressed_chunk_takes_a_few_bytes() -> None:
    data = appended(chunk_record(messages_record([1] * 150_000)))
    assert len(data) < 5000

    with memory_of(16 * MIB):
        assert sum(1 for _ in McapReader(io.BytesIO(data)).raw_messages()) == 150_001


def test_a_chunk_beyond_the_decompression_limit_is_refused(constants: Constants) -> None:
    data = appended(chunk_record(bytes([5]) + (8 * MIB).to_bytes(8, "little") + bytes(8 * MIB)))
    assert len(read(data)) == 1  # channel 0 does not exist

    constants(BAG_EXPANDED_BYTES=MIB)
    with memory_of(MIB), pytest.raises(BagFormatError, match="times as many; the limit is 1048576"):
        read(data)


def test_a_chunk_in_the_summary_is_not_decompressed() -> None:
    data = appended()
    start = int.from_bytes(data[-28:-20], "little")
    bomb = chunk_record(bytes(32 * MIB))
    footer = data[-37:]

    with memory_of(4 * MIB):
        assert read(data[:start] + bomb + data[start:-37] + footer) == [0]


def test_without_chunk_indexes_chunks_are_read_one_at_a_time() -> None:
    times = list(range(40_000))
    data = with_summary(mcap_bytes(times, chunk_bytes=100_000), lambda summary: summary.chunk_indexes.clear())

    with memory_of(2 * MIB):
        reader = McapReader(io.BytesIO(data), limits=Limits(bag_cache_bytes=200_000))
        assert [time for _, _, time, *_ in map(tuple, reader.raw_messages())] == times


def test_a_repair_reads_one_message_at_a_time(tmp_path: Path) -> None:
    data = appended(chunk_record(messages_record([1] * 100_000)))
    file = io.BytesIO()
    path = tmp_path / "x.mcap"
    path.write_bytes(data)
    with memory_of(16 * MIB):
        assert recover(path, file, lambda _: None) == []


def test_an_lz4_chunk_that_expands_200_times_is_refused_before_it_is_expanded() -> None:
    """lz4 reaches a ratio of 255 at most, so that the ratio of other compressions stops nothing."""
    size = 300 * MIB
    header = ChunkHeader("lz4", data_position=0, data_size=size // 200, size=size)
    with pytest.raises(BagFormatError, match=r"expand to 314572800, over 64 times as many"):
        check_chunk(Source(io.BytesIO(b""), "x.mcap"), header)
