import io
import random
import re
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import Image
from std_msgs.msg import Int32, String

from pipros.basics.limits import Limits
from pipros.msg.errors import DeserializationError
from pipros_tools.bag import BagError, BagFormatError, BagReader, NoMessages, NotIndexed
from pipros_tools.bag import chunk_data as chunk_data_module
from pipros_tools.bag.connection import Connection, connection_record
from pipros_tools.bag.index import ChunkInfo, chunk_header_bytes, chunk_info_record, index_record
from pipros_tools.bag.info import bag_info
from pipros_tools.bag.layout import read_chunk_index
from pipros_tools.bag.records import (
    ENTRY,
    MAGIC,
    TIME,
    U32,
    Op,
    file_header,
    parse_head,
    record_bytes,
    time_bytes,
)
from pipros_tools.bag.scan import _walk
from pipros_tools.bag.source import Source
from tests.support.bags import bag_bytes, header_of, old_bag_bytes, rows_of, some_rows, values
from tests.support.constants import Constants
from tests.support.examples import examples


def read(data: bytes, **options: Any) -> BagReader:
    return BagReader(io.BytesIO(data), **options)


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_messages_are_read_as_they_were_written(compression: str, tmp_path: Path) -> None:
    rows = some_rows()
    file = tmp_path / "run.bag"
    file.write_bytes(bag_bytes(rows, compression=compression, chunk_bytes=300))

    with BagReader(file) as bag:
        assert rows_of(bag) == values(rows)
        assert bag.message_count == len(rows)
        assert (bag.start, bag.end) == ((10, 0), (12, 9000))
        assert [connection.topic for connection in bag.connections] == ["/a", "/b"]
        assert len(bag.chunks) > 3
        assert {bag.chunk_header(number).compression for number in range(len(bag.chunks))} == {compression}


@pytest.mark.parametrize("compression", ["none", "lz4"])
def test_large_messages_among_small_ones_are_read_without_a_copy(compression: str) -> None:
    rows: list[Any] = [("/number", Int32(n), n // 10, n % 10) for n in range(40)]
    images = [("/image", Image(data=random.Random(n).randbytes(100_000)), n, 5) for n in range(4)]  # noqa: S311
    rows = sorted([*rows, *images], key=lambda row: row[2:])
    bag = read(bag_bytes(rows, compression=compression, chunk_bytes=250_000))

    found = [(type(data), bytes(data)) for _, _, data, *_ in bag.stored_fields(as_views=True)]

    assert [data for _, data in found] == [data for _, _, data, *_ in bag.stored_fields()]
    assert {kind for kind, data in found if len(data) > 99_000} == {memoryview}
    assert {kind for kind, data in found if len(data) < 99_000} == {bytes}


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_messages_are_selected_when_they_are_next_and_other_chunks_are_not_read(compression: str) -> None:
    rows = some_rows(60)
    data = bytearray(bag_bytes(rows, compression=compression, chunk_bytes=300))
    bag = read(bytes(data))
    assert len(bag.chunks) > 5
    for number in (2, 3):
        header = bag.chunk_header(number)
        data[header.data_position : header.data_position + header.data_size] = bytes(header.data_size)
    bag = read(bytes(data))
    limit_ns = bag.chunks[2].start_ns
    last = bag.chunks[3].end_ns
    times = [seconds * 10**9 + nanoseconds for _, _, seconds, nanoseconds in rows]
    wanted = [time for time in times if not limit_ns <= time <= last]

    found: list[int] = []

    def is_selected(_: Connection, time_ns: int) -> bool:
        return len(found) < times.index(limit_ns) or time_ns > last

    for _, time_ns, *_ in bag.stored_fields(where=is_selected):
        found.append(time_ns)
    assert found == wanted


def test_topics_times_and_connections_choose_messages() -> None:
    rows = some_rows()
    bag = read(bag_bytes(rows, chunk_bytes=300))

    assert rows_of(bag, topics="/b") == [row for row in values(rows) if row[0] == "/b"]
    assert rows_of(bag, topics=["/b", "/none"]) == rows_of(bag, topics="/b")
    assert rows_of(bag, topics=[]) == []
    assert rows_of(bag, start=11.0, end=11.0) == [row for row in values(rows) if row[2:] == (11, 0)]
    assert rows_of(bag, where=lambda connection: connection.type == "std_msgs/Int32") == rows_of(
        bag, topics="/a"
    )
    assert [message.time.secs for message in bag[12:]] == [12] * 10
    with pytest.raises(TypeError, match="the index must be a slice without a step"):
        bag[3]  # type: ignore[index]


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 20)), max_size=60),
    st.sampled_from([1, 200, 1000]),
)
def test_messages_are_read_in_time_order_for_any_order_of_writing(
    written: list[tuple[str, int]], chunk_bytes: int
) -> None:
    rows: list[Any] = [(f"/{topic}", Int32(n), time, 0) for n, (topic, time) in enumerate(written)]
    topics = list(dict.fromkeys(f"/{topic}" for topic, _ in written))

    found = rows_of(read(bag_bytes(rows, chunk_bytes=chunk_bytes)))

    # Messages with equal times are in the order of their connections, then of writing.
    assert found == sorted(values(rows), key=lambda row: (row[2], topics.index(row[0]), row[1]))


def test_only_overlapping_chunks_are_kept_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [("/a", String("x" * 1000), n, 0) for n in range(200)]
    bag = read(bag_bytes(rows, chunk_bytes=2000))
    kept: list[int] = []
    keep = chunk_data_module.ChunkStore._keep

    def watch(self: Any, number: int, data: bytes) -> None:
        keep(self, number, data)
        kept.append(len(self._kept))

    monkeypatch.setattr(chunk_data_module.ChunkStore, "_keep", watch)
    assert (len(rows_of(bag)), max(kept)) == (200, 1)


def test_overlapping_chunks_beyond_the_cache_are_read_again() -> None:
    rows: list[Any] = []
    for n in range(20):
        rows += [
            ("/a", String("x" * 500), n, 0), ("/a", String("y" * 500), 100 + n, 0), ("/b", Int32(n), 0, 0)
        ]  # fmt: skip
    bag = read(bag_bytes(rows, chunk_bytes=1000), limits=Limits(bag_cache_bytes=1))

    assert [row[2] for row in rows_of(bag, topics="/a")] == [*range(20), *range(100, 120)]


def test_messages_of_a_large_chunk_are_read_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    # Not an argument, because no user has a reason to change it, and a real large chunk has 16 MiB.
    monkeypatch.setattr(chunk_data_module, "LARGE_BYTES", 100)
    rows = some_rows()

    assert rows_of(read(bag_bytes(rows))) == values(rows)


def test_timestamps_are_offered_as_seconds_and_nanoseconds_too() -> None:
    bag = read(bag_bytes([("/a", Int32(n), 10 + n, n) for n in range(4)]))

    assert (bag.start, bag.end) == ((10, 0), (13, 3))
    assert bag.times(bag.connections) == bag.times_by_connection()[0] == [(10 + n, n) for n in range(4)]
    assert [message[1:4] for message in bag.raw_messages(None, (11, 1), (12, 2))] == [
        (11, 1, b"\1\0\0\0"),
        (12, 2, b"\2\0\0\0"),
    ]
    assert [time_ns for _, time_ns, _ in bag.decoded(None, 11_000_000_002)] == [
        12_000_000_002,
        13_000_000_003,
    ]


def test_a_file_needs_no_more_than_read_and_seek() -> None:
    class Bare:
        def __init__(self, data: bytes) -> None:
            file = io.BytesIO(data)
            self.read, self.seek = file.read, file.seek

    rows: list[Any] = [("/a", Image(data=bytes([n]) * 200_000), 10 + n, 0) for n in range(3)]

    assert [each.message for each in BagReader(Bare(bag_bytes(rows)))] == [row[1] for row in rows]


@pytest.mark.parametrize("compression", ["none", "bz2"])
@pytest.mark.parametrize("chunk_bytes", [1, 1_000_000])
def test_large_messages_stay_as_they_are_while_later_ones_are_read(
    chunk_bytes: int, compression: str
) -> None:
    rows: list[Any] = [
        (f"/{n % 3}", String(str(n) * 100_000) if n % 3 else Image(data=bytes([n]) * 200_000), 10 + n, 0)
        for n in range(9)
    ]
    data = bag_bytes(rows, chunk_bytes=chunk_bytes, compression=compression)

    read_at_once = [message for _, message, _, _ in read(data)]

    assert read_at_once == [row[1] for row in rows]
    assert {type(each.data) for each in read_at_once} == {bytes, str}
    stored = list(read(data).stored_messages())
    assert [read(data).decode(each) for each in stored] == read_at_once
    assert {type(each.data) for each in stored} == {bytes}


def test_a_timestamp_beyond_the_range_of_ros_times_is_refused() -> None:
    last, beyond = TIME.pack(2**32 - 1, 5), TIME.pack(2**32 - 1, 2 * 10**9)
    record, entry, start, *rest = bag_bytes([("/a", Int32(1), 2**32 - 1, 5)]).split(last)

    with read(last.join((record, entry, start, *rest))) as bag:
        assert rows_of(bag) == [("/a", 1, 2**32 - 1, 5)]
    with (
        read(record + last + entry + beyond + last.join((start, *rest))) as bag,
        pytest.raises(BagFormatError, match="timestamps must be below"),
    ):
        rows_of(bag)
    with pytest.raises(NotIndexed, match="timestamps must be below"):
        read(record + last + entry + last + start + beyond + last.join(rest))


def test_an_unknown_type_is_defined_by_the_bag() -> None:
    definition = b"string data\nint32 more\n"
    header = {**header_of(String(), "/a"), "md5sum": b"0" * 32, "message_definition": definition}
    file = io.BytesIO()
    from pipros_tools.bag import BagWriter

    writer = BagWriter(file)
    writer.write(writer.add_connection("/a", header), 1, 0, b"\x02\0\0\0hi\x07\0\0\0")
    writer.write(writer.add_connection("/b", header_of(String(), "/b")), 2, 0, b"\x02\0\0\0ho")
    writer.finish()
    strange, known = (message for _, message, _, _ in read(file.getvalue()))

    assert (strange.data, strange.more) == ("hi", 7)
    assert type(known) is String
    assert not hasattr(String(), "more")


def test_a_broken_definition_names_the_topic() -> None:
    data = (
        bag_bytes([("/a", String("x"), 1, 0)])
        .replace(b"string data ", b"string 1ata ")
        .replace(String._md5sum.encode(), b"0" * 32)
    )

    with pytest.raises(BagError, match=r"the bag's definition of std_msgs/String \(topic /a\) is broken"):
        list(read(data).messages())


def test_a_bag_without_messages_has_no_times() -> None:
    bag = read(bag_bytes([]))

    assert (rows_of(bag), bag.message_count) == ([], 0)
    with pytest.raises(NoMessages):
        _ = bag.start


@pytest.mark.parametrize(("data", "error", "words"), [
    (b"", BagError, "is an empty file"),
    (b"#!/bin/sh\n", BagError, "is not a bag: it must begin with #ROSBAG V2.0"),
    (b"#ROSBAG V3.0\n", BagFormatError, "bag version must be 1.2 or 2.0, got 3.0"),
    (b"#ROSBAG V2.0\n", NotIndexed, "Run rosbag reindex"),
    (bag_bytes(some_rows(), is_finished=False), NotIndexed, "has no index"),
    (bag_bytes(some_rows())[:-1], NotIndexed, "damaged index"),
    (bag_bytes(some_rows())[:4500], NotIndexed, "ends before its index"),
])  # fmt: skip
def test_an_incomplete_bag_is_refused(data: bytes, error: type[Exception], words: str) -> None:
    with pytest.raises(error) as raised:
        read(data)
    assert words in str(raised.value)


def test_a_bag_that_ends_within_a_records_length_is_refused() -> None:
    source = Source(io.BytesIO(b"#ROSBAG V2.0\n\x01\x00"), "cut.bag")
    with pytest.raises(BagFormatError, match=r"^cut\.bag, byte 13: the file ends within the length field"):
        source.header(13)


def test_a_chunk_larger_than_the_limit_is_refused(constants: Constants) -> None:
    constants(BAG_CHUNK_BYTES=100)
    bag = read(bag_bytes(some_rows(), compression="bz2"))

    with pytest.raises(BagFormatError, match="its size must be at most 100 bytes"):
        list(bag.raw_messages())


@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_decompression_stops_at_the_claimed_size_of_the_chunk(compression: str) -> None:
    data = bytearray(bag_bytes([("/a", String("x" * 100_000), 1, 0)], compression=compression))
    at = data.index(b"size=") + 5
    data[at : at + 4] = (1000).to_bytes(4, "little")

    with pytest.raises(BagFormatError, match="the chunk must be 1000 bytes long, got 1001"):
        list(read(bytes(data)).raw_messages())


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_a_flipped_bit_raises_an_explained_error_or_changes_at_most_one_message(compression: str) -> None:
    whole = bag_bytes(some_rows(), compression=compression, chunk_bytes=400)
    intact = [raw[3] for raw in read(whole).raw_messages()]
    rng = random.Random(1)  # noqa: S311
    places = [at for at in range(len(whole)) if not 90 < at < 4117]
    errors = []
    for at in rng.sample(places, min(len(places), examples(400))):
        data = bytearray(whole)
        data[at] ^= 1 << rng.randrange(8)
        for rebuild in (False, True):
            try:
                found = [raw[3] for raw in read(bytes(data), rebuild_index=rebuild).raw_messages()]
            except BagError as error:
                errors.append(str(error))
                continue
            assert len(found) <= len(intact)
            assert sum(body not in intact for body in found) <= 1
    assert [
        text for text in errors if not re.search(r"byte \d+|must begin with #ROSBAG|Run rosbag reindex", text)
    ] == []


def test_bags_of_format_1_2_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros_tools.bag.old_format._PART_BYTES", 500)
    rows = some_rows()
    data = old_bag_bytes(rows, is_indexed=False)
    bag = read(data)

    assert bag.layout.version.number == 102
    assert rows_of(bag) == values(rows)
    assert bag.damage == []
    cut = read(data[:-3])
    assert rows_of(cut) == values(rows)[:-1]
    assert "the file ends within this record" in cut.damage[0]


def test_two_iterations_at_once_do_not_disturb_each_other() -> None:
    bag = read(bag_bytes(some_rows(), chunk_bytes=200, compression="bz2"))

    pairs = list(zip(bag.raw_messages(), bag.raw_messages(), strict=True))

    assert len(pairs) == 30
    assert all(one == other for one, other in pairs)


def test_a_bag_of_many_topics_is_described_and_read_with_one_look_at_each_chunk(monkeypatch) -> None:
    rows = [(f"/t{n % 1000}", Int32(n), n // 100, n % 100) for n in range(3000)]
    bag = read(bag_bytes(rows, chunk_bytes=50_000))
    looked: list[int] = []

    def watch(*arguments: Any) -> Any:
        looked.append(arguments[2].position)
        return read_chunk_index(*arguments)

    monkeypatch.setattr("pipros_tools.bag.contents.read_chunk_index", watch)
    info = bag_info(bag, "x", with_frequencies=True)
    found = [len(list(bag.raw_messages(bag.connections_of(f"/t{n}")))) for n in range(20)]

    assert (len(info.topics), found) == (1000, [3] * 20)
    assert looked == [chunk.position for chunk in bag.chunks]


def test_a_chunk_of_three_gigabytes_is_read_where_its_messages_are(tmp_path: Path) -> None:
    """Offsets above 2^31 are used; the bytes between are a hole in the file."""
    size, offset = 3_000_000_000, 2_999_999_000
    header = header_of(Int32(), "/a")
    connection = Connection(0, "/a", header)
    chunk = ChunkInfo(len(MAGIC) + 4096 + 8, 5 * 10**9, 5 * 10**9, {0: 1})
    path = tmp_path / "large.bag"
    with path.open("wb") as file:
        file.seek(chunk.position)
        start = file.tell() + file.write(chunk_header_bytes("none", size, size))
        file.seek(start + offset)
        file.write(
            record_bytes({"op": b"\x02", "conn": bytes(4), "time": b"\5\0\0\0" + bytes(4)}, b"\7\0\0\0")
        )
        file.seek(start + size)
        file.write(index_record(0, ENTRY.pack(5, 0, offset)))
        end = file.tell()
        file.write(connection_record(connection) + chunk_info_record(chunk))
        file.seek(0)
        file.write(MAGIC + file_header(end, 1, 1))

    with BagReader(path) as bag:
        assert (rows_of(bag), bag.chunk_header(0).size) == ([("/a", 7, 5, 0)], size)


def test_the_connections_of_each_topic_are_found_without_a_search_through_all(tmp_path, monkeypatch) -> None:
    path = tmp_path / "many.bag"
    path.write_bytes(bag_bytes([(f"/t{number}", Int32(number), number, 0) for number in range(30)]))
    with BagReader(path) as bag:
        searches: list[None] = []
        every = bag.layout.connections

        class Counted(dict[int, Connection]):
            def values(self) -> Any:
                searches.append(None)
                return super().values()

        bag.layout.connections = Counted(every)
        found = [bag.connections_of(f"/t{number}") for number in range(30)]
        assert [[each.topic for each in topic] for topic in found] == [
            [f"/t{number}"] for number in range(30)
        ]
        assert bag.connections_of("/none") == []
    assert len(searches) == 1


def test_a_message_that_its_type_does_not_fit_is_an_error_or_reported() -> None:
    file = io.BytesIO()
    from pipros_tools.bag import BagWriter

    writer = BagWriter(file)
    writer.write(writer.add_connection("/a", header_of(String(), "/a")), 1, 0, b"\x09\0\0\0short")
    writer.write(writer.add_connection("/b", header_of(String(), "/b")), 2, 0, b"\x02\0\0\0ho")
    writer.finish()

    bag = read(file.getvalue())
    with pytest.raises(DeserializationError):
        list(bag.decoded())
    reported: list[str] = []
    bag.on_bad_message = lambda topic, _: reported.append(topic)
    assert [message.data for _, _, message in bag.decoded()] == ["ho"]
    assert reported == ["/a"]


def test_a_definition_that_nothing_understands_is_an_error_or_reported() -> None:
    rows = [("/a", String("x"), 1, 0)]
    broken = bag_bytes(rows).replace(b"string data ", b"string 1ata ")
    bag = read(broken.replace(String._md5sum.encode(), b"0" * 32))

    with pytest.raises(BagError, match="is broken"):
        list(bag.decoded())
    reported: list[str] = []
    bag.on_bad_message = lambda topic, _: reported.append(topic)
    assert (list(bag.decoded()), reported) == ([], ["/a"])


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
