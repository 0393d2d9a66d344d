"""Untrusted bags that would take far more memory or time than their size suggests are refused."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import pytest
from std_msgs.msg import Int32

from pipros_tools.bag import BagFormatError, BagReader, BagWriter, NotIndexed
from pipros_tools.bag.compression import compress
from pipros_tools.bag.index import ChunkInfo, chunk_header_bytes, index_record
from pipros_tools.bag.layout import BagLayout
from pipros_tools.bag.records import ENTRY, TIME, U32, Op, record_bytes
from tests.support.bags import bag_bytes, some_rows
from tests.support.constants import Constants
from tests.support.memory import memory_of

MIB = 1 << 20


def changed(data: bytes, change: Callable[[BagLayout], None], more: bytes = b"") -> bytes:
    """Return a bag with `more` after its chunks, and the index of the changed layout."""
    file = io.BytesIO(data)
    layout = BagReader(file).layout
    file.seek(layout.end)
    layout.end += file.write(more)
    change(layout)
    BagWriter(file, layout=layout).finish()
    return file.getvalue()


def appended(*parts: bytes, chunks: Sequence[int], counts: Mapping[int, int]) -> bytes:
    """A bag of a message and these parts, with chunks at these offsets in the parts."""

    def change(layout: BagLayout) -> None:
        first = layout.end - sum(map(len, parts))
        layout.chunks += [ChunkInfo(first + at, 10 * 10**9, 20 * 10**9, counts) for at in chunks]

    return changed(bag_bytes([("/a", Int32(1), 10, 0)]), change, b"".join(parts))


def chunk_of(content: bytes, compression: str = "none") -> bytes:
    data = bytes(compress(compression, content))
    return chunk_header_bytes(compression, len(content), len(data)) + data


def message_record(connection: int, data: bytes = b"\x01\0\0\0") -> bytes:
    fields = {"op": bytes([Op.MESSAGE]), "conn": U32.pack(connection), "time": TIME.pack(10, 0)}
    return record_bytes(fields, data)


def test_a_chunk_that_the_index_names_twice_is_refused() -> None:
    def repeat(layout: BagLayout) -> None:
        layout.chunks *= 2000

    data = changed(bag_bytes(some_rows(3000)), repeat)

    with memory_of(10 * MIB), pytest.raises(NotIndexed, match=r"lists the chunk at byte 4117 twice"):
        list(BagReader(io.BytesIO(data)).raw_messages())
    rebuilt = BagReader(io.BytesIO(data), rebuild_index=True)
    assert rebuilt.message_count == 3000


def test_chunks_that_share_an_index_are_refused() -> None:
    """Each chunk's data contain the next chunk; the entries follow the innermost one."""
    start = len(chunk_of(b""))
    starts = [chunk_header_bytes("none", start * left, start * left) for left in reversed(range(500))]
    entries = index_record(0, ENTRY.pack(10, 0, 0) * 1000)
    data = appended(*starts, entries, chunks=[0, start * 499], counts={0: 1000})

    with pytest.raises(BagFormatError, match=r"the chunk must end before the next one, at byte \d+"):
        list(BagReader(io.BytesIO(data)).raw_messages())


def test_an_index_of_more_messages_than_the_file_has_room_for_is_refused() -> None:
    def multiply(layout: BagLayout) -> None:
        layout.chunks[0] = replace(layout.chunks[0], counts={0: 10**9, 1: 15})

    data = changed(bag_bytes(some_rows()), multiply)

    with pytest.raises(NotIndexed, match="1000000015 messages"):
        BagReader(io.BytesIO(data))


def test_repeated_entries_of_one_message_are_refused() -> None:
    content = message_record(0, bytes(10_000))
    entries = index_record(0, ENTRY.pack(10, 0, 0) * 1000)
    data = appended(chunk_of(content), entries, chunks=[0], counts={0: 1000})

    read: list[object] = []
    with pytest.raises(BagFormatError, match="the messages are larger than their chunk"):
        read.extend(BagReader(io.BytesIO(data)).raw_messages())
    assert len(read) == 2


def test_index_records_of_one_connection_are_joined_in_one_pass() -> None:
    count = 20_000
    records = index_record(0, ENTRY.pack(10, 0, 0)) * count
    counts = dict.fromkeys(range(count), 1)
    bag = BagReader(io.BytesIO(appended(chunk_of(message_record(0)), records, chunks=[0], counts=counts)))

    assert bag.chunk_index(1) == {0: ENTRY.pack(10, 0, 0) * count}


def test_a_chunk_beyond_the_decompression_limit_is_refused(constants: Constants) -> None:
    content = message_record(0, bytes(8 * MIB))
    entries = index_record(0, ENTRY.pack(10, 0, 0))
    data = appended(chunk_of(content, "bz2"), entries, chunks=[0], counts={0: 1})
    # blank images are just as small
    assert sum(1 for _ in BagReader(io.BytesIO(data)).raw_messages()) == 2

    constants(BAG_EXPANDED_BYTES=MIB)
    with memory_of(MIB), pytest.raises(BagFormatError, match=r"times as many; the limit is 1048576"):
        list(BagReader(io.BytesIO(data)).raw_messages())
    rebuilt = BagReader(io.BytesIO(data), rebuild_index=True)
    assert rebuilt.message_count == 1
    assert "times as many; the limit is 1048576" in rebuilt.damage[0]


def test_a_bag_that_expands_to_too_many_messages_is_not_indexed(constants: Constants) -> None:
    content = message_record(0) * 20_000
    data = appended(*[chunk_of(content, "bz2")] * 20, chunks=[], counts={})

    constants(BAG_RECORDS=50_000)
    rebuilt = BagReader(io.BytesIO(data), rebuild_index=True)

    assert "too many records; the limit is 50000" in rebuilt.damage[0]
    assert rebuilt.message_count == 60_001
