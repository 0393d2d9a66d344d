import io
import random
import re
from pathlib import Path
from typing import Any

import lz4.frame
import pytest
from hypothesis import given
from hypothesis import strategies as st
from std_msgs.msg import Int32, String

from pipros.basics.extras import install_command
from pipros.msg.errors import SerializationError
from pipros_tools.bag import BagError, BagReader, BagWriter, NotIndexed
from pipros_tools.bag.compression import compress, decompress
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.index import ChunkInfo, chunk_info_record, index_record, parse_chunk_info, parse_index
from pipros_tools.bag.lz4_frame import decompress_frame, xxh32
from pipros_tools.bag.records import (
    field_bytes,
    file_header,
    number,
    parse_fields,
    parse_version,
    record_bytes,
)
from pipros_tools.bag.sinks import WholeWrites
from tests.support.bags import bag_bytes, header_of, rows_of, some_rows, values


def test_the_layout_is_the_one_of_genuine_rosbag() -> None:
    data = bag_bytes([("/a", Int32(7), 5, 6)])

    assert data[:13] == b"#ROSBAG V2.0\n"
    assert data[13:17] == (69).to_bytes(4, "little")
    assert data[4117:4158].endswith(b"size=")
    assert b"op=\x02\x09\0\0\0conn=\0\0\0\0\x0d\0\0\0time=\x05\0\0\0\x06\0\0\0\x04\0\0\0\x07\0\0\0" in data


def test_an_invalid_message_writes_nothing() -> None:
    file = io.BytesIO()
    writer = BagWriter(file)
    connection = writer.add_connection("/a", header_of(Int32(), "/a"))
    writer.write_message(connection, 1, 0, Int32(1))
    with pytest.raises(SerializationError):
        writer.write_message(connection, 2, 0, Int32("x"))  # type: ignore[arg-type]
    writer.write_message(connection, 3, 0, Int32(3))
    writer.finish()
    writer.finish()

    assert rows_of(BagReader(file)) == [("/a", 1, 1, 0), ("/a", 3, 3, 0)]


def test_messages_can_be_appended() -> None:
    rows = some_rows(20)
    file = io.BytesIO(bag_bytes(rows[:10], chunk_bytes=100))
    before = BagReader(file)
    writer = BagWriter(file, layout=before.layout, compression="bz2")

    with pytest.raises(NotIndexed):  # the old index was overwritten
        BagReader(io.BytesIO(file.getvalue()))
    connection = writer.add_connection("/new", header_of(String(), "/new"))
    for _, message, seconds, nanoseconds in rows[10:]:
        writer.write_message(connection, seconds, nanoseconds, String(str(message.data)))
    writer.finish()
    found = rows_of(BagReader(file))

    assert found[:10] == values(rows[:10])
    assert [row[1] for row in found[10:]] == [str(row[1].data) for row in rows[10:]]


def test_an_unknown_compression_is_refused() -> None:
    with pytest.raises(BagError, match=r"must be one of none, bz2, lz4, got \[zip\]"):
        bag_bytes(some_rows(), compression="zip")


def test_lz4_without_its_library_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros_tools.bag.compression._lz4", lambda: None)

    with pytest.raises(BagError, match=re.escape(install_command("lz4"))):
        bag_bytes(some_rows(), compression="lz4")


def test_lz4_is_read_without_its_library(monkeypatch: pytest.MonkeyPatch) -> None:
    data = bag_bytes(some_rows(), compression="lz4")
    monkeypatch.setattr("pipros_tools.bag.compression._lz4", lambda: None)

    assert rows_of(BagReader(io.BytesIO(data))) == values(some_rows())


class _FullDisk(io.BytesIO):
    """Accepts at most `room` bytes."""

    room = 1_000_000

    def write(self, data: Any, /) -> int:
        left = self.room - self.tell()
        if len(data) > left:
            super().write(bytes(data)[: max(0, left)])
            raise OSError(28, "No space left on device")
        return super().write(data)


def test_complete_chunks_survive_a_full_disk_and_writing_continues_when_there_is_room() -> None:
    file = _FullDisk()
    writer = BagWriter(file, chunk_bytes=200)
    connection = writer.add_connection("/a", header_of(Int32(), "/a"))
    file.room = 5000
    numbers = iter(range(1000))

    def write_on() -> None:
        for n in numbers:
            writer.write_message(connection, n, 0, Int32(n))

    with pytest.raises(OSError, match="No space left"):
        write_on()
    written = next(numbers) - 1
    complete = writer.layout.end
    rebuilt = BagReader(io.BytesIO(file.getvalue()), rebuild_index=True)
    found = rows_of(rebuilt)

    assert found == [("/a", n, n, 0) for n in range(len(found))]
    assert len(found) >= sum(sum(chunk.counts.values()) for chunk in writer.layout.chunks) > 0
    assert complete <= 5000
    file.room = 1_000_000
    writer.finish()
    assert [row[1] for row in rows_of(BagReader(file))] == [*range(written + 1)]


class _LittleFile(WholeWrites):
    """Accepts at most `room` bytes; a write that does not fit is partial."""

    room = 1_000_000

    def write(self, data: Any, /) -> int:
        size = len(memoryview(data).cast("B"))
        left = max(0, self.room - self.tell())
        if size > left:
            super().write(bytes(data)[:left])
            raise OSError(28, "No space left on device")
        return super().write(data)


@pytest.mark.parametrize("room", [4600, 5000, 5001, 5200, 6000, 9000])
def test_on_a_full_disk_the_newest_messages_make_room_for_the_index(room: int, tmp_path: Path) -> None:
    path = tmp_path / "full.bag"
    with _LittleFile(path, "w+") as file:
        writer = BagWriter(file, chunk_bytes=200)
        connection = writer.add_connection("/a", header_of(Int32(), "/a"))
        file.room = room
        written = 0
        with pytest.raises(OSError, match="No space left"):  # noqa: PT012
            for n in range(1000):
                written += 1
                writer.write_message(connection, n, 0, Int32(n))
        lost = writer.finish_with_what_fits()

    with BagReader(path) as bag:
        assert [row[1] for row in rows_of(bag)] == list(range(written - lost))
    assert path.stat().st_size <= room
    assert lost > 0


def test_a_disk_too_full_for_an_empty_bag_is_an_error(tmp_path: Path) -> None:
    with _LittleFile(tmp_path / "full.bag", "w+") as file:
        writer = BagWriter(file)
        connection = writer.add_connection("/a", header_of(Int32(), "/a"))
        writer.write_message(connection, 1, 0, Int32(1))
        file.room = 4300
        with pytest.raises(OSError, match="No space left"):
            writer.finish_with_what_fits()


NAMES = st.text(st.characters(codec="utf-8", exclude_characters="="), max_size=8)


@given(st.dictionaries(NAMES, st.binary(max_size=20)))
def test_header_fields_survive_a_round_trip(fields: dict[str, bytes]) -> None:
    assert parse_fields(field_bytes(fields), "x") == fields


@given(st.binary(max_size=60))
def test_arbitrary_bytes_are_fields_or_an_error_with_its_position(data: bytes) -> None:
    error: Exception | None = None
    try:
        parse_fields(data, "run.bag, byte 7")
    except BagFormatError as raised:
        error = raised
    assert error is None or str(error).startswith("run.bag, byte 7: ")


def test_a_record_is_header_and_data() -> None:
    assert record_bytes({"op": b"\x02"}, b"ab") == b"\x08\0\0\0\x04\0\0\0op=\x02\x02\0\0\0ab"


def test_the_file_header_has_a_fixed_size() -> None:
    assert len(file_header(0, 0, 0)) == len(file_header(1 << 40, 1000, 1000)) == 4104


@pytest.mark.parametrize("line", [b"#ROSBAG V2", b"#ROSBAG 2.0", b"#ROSBAG V-1.0", b"#ROSBAG Vx.y", b""])
def test_other_first_lines_have_no_version(line: bytes) -> None:
    assert parse_version(line) is None


def test_numbers_must_have_their_size() -> None:
    with pytest.raises(BagFormatError, match=r"x: the field \[conn\] must be 4 bytes long, got 2"):
        number({"conn": b"ab"}, "conn", 4, "x")
    with pytest.raises(BagFormatError, match=r"x: the field \[conn\] is missing"):
        number({}, "conn", 4, "x")


def test_chunk_infos_and_indexes_survive_a_round_trip() -> None:
    info = ChunkInfo(1 << 33, 1_000_000_002, 3_000_000_004, {0: 5, 7: 1})
    record = chunk_info_record(info)
    size = int.from_bytes(record[:4], "little")
    fields, data = parse_fields(record[4 : 4 + size], "x"), record[8 + size :]
    assert parse_chunk_info(fields, data, "x") == info
    with pytest.raises(BagFormatError, match="2 connections need 16 bytes, got 15"):
        parse_chunk_info(fields, data[:-1], "x")

    record = index_record(3, bytes(24))
    size = int.from_bytes(record[:4], "little")
    fields = parse_fields(record[4 : 4 + size], "x")
    assert parse_index(fields, bytes(24), "x") == (3, bytes(24))
    with pytest.raises(BagFormatError, match="2 entries need 24 bytes, got 12"):
        parse_index(fields, bytes(12), "x")


CONTENTS = st.one_of(
    st.binary(max_size=300),
    st.builds(lambda part, times: part * times, st.binary(min_size=1, max_size=20), st.integers(0, 5000)),
)


@given(CONTENTS, st.booleans(), st.booleans(), st.booleans())
def test_frames_of_the_library_are_read(data: bytes, is_linked: bool, checks: bool, has_size: bool) -> None:
    frame = lz4.frame.compress(
        data, block_linked=is_linked, block_checksum=checks, content_checksum=checks, store_size=has_size
    )

    assert decompress_frame(frame, len(data), "x") == data


@given(CONTENTS)
def test_compressed_data_is_read_by_both(data: bytes) -> None:
    frame = bytes(compress("lz4", data))

    assert decompress_frame(frame, len(data), "x") == data
    assert decompress("lz4", frame, len(data), "x") == data


def test_frames_may_have_many_blocks() -> None:
    data = random.Random(1).randbytes(1000) * 300  # noqa: S311

    assert decompress_frame(lz4.frame.compress(data, block_size=4), len(data), "x") == data


@pytest.mark.parametrize(("data", "value"), [(b"", 0x02CC5D05), (b"a", 0x550D7456), (b"a" * 40, 0x6A9616D6)])
def test_the_checksum_is_xxh32(data: bytes, value: int) -> None:
    assert xxh32(data) == value


def test_damage_is_detected_within_the_size_limit() -> None:
    data = bytes(range(256)) * 4 + b"hello world " * 2
    frame = bytes(compress("lz4", data))
    rng = random.Random(1)  # noqa: S311
    for at in range(len(frame)):
        broken = bytearray(frame)
        broken[at] ^= 1 << rng.randrange(8)
        with pytest.raises(BagFormatError, match="x: the lz4 data are damaged"):
            decompress_frame(bytes(broken), len(data), "x")
        with pytest.raises(BagFormatError, match="x: the lz4 data are damaged"):
            decompress_frame(frame[:at], len(data), "x")
    with pytest.raises(BagFormatError, match="more bytes than allowed"):
        decompress_frame(frame, len(data) - 1, "x")
