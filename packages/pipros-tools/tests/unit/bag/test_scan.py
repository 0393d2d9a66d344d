from __future__ import annotations

import io
from itertools import count

import pytest

from pipros_tools.bag import BagError, BagFormatError, BagReader
from pipros_tools.bag.records import U32, Op, parse_head, record_bytes, time_bytes
from pipros_tools.bag.scan import _walk
from pipros_tools.bag.source import Source
from tests.support.bags import bag_bytes, rows_of, some_rows, values
from tests.support.constants import Constants
from tests.support.examples import examples

ROWS = some_rows(12)


def rebuilt(data: bytes) -> BagReader:
    return BagReader(io.BytesIO(data), rebuild_index=True)


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_a_file_cut_at_any_byte_gives_all_complete_chunks(compression: str) -> None:
    whole = bag_bytes(ROWS, compression=compression, chunk_bytes=250)
    chunks = BagReader(io.BytesIO(whole)).layout
    ends = [chunk.position for chunk in chunks.chunks[1:]] + [chunks.index_position]
    for size in range(4117, len(whole), len(whole) // examples(len(whole))):
        bag = rebuilt(whole[:size])
        found = rows_of(bag)
        complete = sum(
            sum(chunk.counts.values()) for chunk, end in zip(chunks.chunks, ends, strict=True) if end <= size
        )
        assert found == values(ROWS)[: len(found)]
        assert len(found) >= complete


def test_a_file_cut_within_its_start_is_empty_or_refused() -> None:
    whole = bag_bytes(ROWS)
    for size in range(13):
        with pytest.raises(BagError):
            rebuilt(whole[:size])
    for size in [*range(13, 120), 4000, 4116]:
        assert rows_of(rebuilt(whole[:size])) == []


def test_a_chunk_that_was_being_written_gives_its_complete_messages() -> None:
    """Genuine rosbag writes uncompressed chunks in pieces, with a size of zero until they are complete."""
    whole = bytearray(bag_bytes(ROWS))
    index = BagReader(io.BytesIO(bytes(whole))).chunk_header(0)
    header = whole.index(b"size=") + 5
    whole[header : header + 8] = bytes(8)
    cut = bytes(whole[: index.data_position + index.data_size - 3])

    bag = rebuilt(cut)

    assert rows_of(bag) == values(ROWS)[:-1]
    assert "was not finished" in bag.damage[0]
    assert ["the last message is cut off" in text for text in bag.damage[1:]] == [True]


def test_chunks_behind_a_damaged_place_are_found() -> None:
    whole = bytearray(bag_bytes(ROWS, compression="bz2", chunk_bytes=250))
    layout = BagReader(io.BytesIO(bytes(whole))).layout
    second = layout.chunks[1].position
    whole[second : second + 8] = b"\xff" * 8

    bag = rebuilt(bytes(whole))

    lost = sum(layout.chunks[1].counts.values())
    assert len(rows_of(bag)) == len(ROWS) - lost
    assert f"byte {second}" in bag.damage[0]


def test_a_header_in_a_chunk_has_the_limit_of_all_headers(constants: Constants) -> None:
    fields = {"op": bytes([Op.MESSAGE]), "conn": U32.pack(0), "time": time_bytes(10**9)}
    whole = record_bytes(fields, b"data")  # with a header of 38 bytes

    def read(at: int, size: int) -> bytes:
        return whole[at : at + size]

    assert _walk(read, len(whole), "x", count()).size == len(whole)
    constants(BAG_HEADER_BYTES=37)
    assert _walk(read, len(whole), "x", count()).size == 0
    with pytest.raises(BagFormatError, match="x: a record's header must be at most 37 bytes long, got 38"):
        parse_head(read, 0, "x")


def test_a_record_larger_than_the_limit_is_refused_before_it_is_read(constants: Constants) -> None:
    source = Source(io.BytesIO(bytes(200)), "run.mcap")
    constants(BAG_RECORD_BYTES=100)
    assert len(source.read(7, 100)) == 100
    with pytest.raises(
        BagFormatError, match=r"mcap, byte 7: a record must be at most 100 bytes long, got 101"
    ):
        source.read(7, 101)


def test_progress_is_reported() -> None:
    told: list[int] = []

    BagReader(io.BytesIO(bag_bytes(ROWS)), rebuild_index=True, progress=told.append)

    assert told == sorted(told)
    assert told[0] == 13
