from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Int32, String

from pipros.basics.extras import install_command
from pipros.msg.errors import SerializationError
from pipros_tools.bag import BagError, BagReader, BagWriter, NotIndexed
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
