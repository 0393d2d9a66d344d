"""rosbag2, mcap: after a power failure, a file lacks its summary; each tool refers users to another one."""

from __future__ import annotations

import io
import sqlite3
import struct
from pathlib import Path

import pytest
from mcap.writer import CompressionType, Writer

from pipros_rosbag2.bags.reader import open_any_bag
from pipros_tools.cli.rosbag import main


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def mcap_of(count: int) -> bytes:
    """Return an MCAP file of ROS 2 with a chunk for each message."""
    file = io.BytesIO()
    writer = Writer(file, chunk_size=1, compression=CompressionType.NONE)
    writer.start(profile="ros2", library="x")
    schema = writer.register_schema("std_msgs/msg/Int32", "ros2msg", b"int32 data")
    channel = writer.register_channel("/number", "cdr", schema)
    for number in range(count):
        writer.add_message(channel, number, b"\0\1\0\0" + struct.pack("<i", number), number)
    writer.finish()
    return file.getvalue()


def numbers(path: str) -> list[int]:
    with open_any_bag(path) as bag:
        return [message.data for _, message, *_ in bag.messages()]


def test_the_advice_for_a_cut_mcap_file_leads_to_its_messages(capsys: pytest.CaptureFixture[str]) -> None:
    content = mcap_of(9)
    Path("cut.mcap").write_bytes(content[: content.rindex(struct.pack("<i", 7)) - 3])

    assert main(["info", "cut.mcap"]) == 1
    assert "Run rosbag reindex" in capsys.readouterr().err
    assert main(["reindex", "cut.mcap"]) == 0
    assert numbers("cut.mcap")[:7] == [0, 1, 2, 3, 4, 5, 6]
    assert main(["info", "cut.mcap"]) == 0
    assert "version:     ROS 2 jazzy, mcap" in capsys.readouterr().out


def test_a_cut_file_of_a_split_recording_does_not_hide_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    Path("run").mkdir()
    Path("run/run_0.mcap").write_bytes(mcap_of(3))
    Path("run/run_1.mcap").write_bytes(mcap_of(5)[:-50])

    assert main(["info", "run"]) == 1
    assert "run/run_1.mcap" in capsys.readouterr().err
    assert numbers("run") == [0, 1, 2]
    assert main(["reindex", "run/run_1.mcap"]) == 0
    assert sorted(numbers("run")) == [0, 0, 1, 1, 2, 2, 3, 4]  # the copy run_1.orig.mcap is not read


def test_a_cut_database_keeps_its_first_messages(capsys: pytest.CaptureFixture[str]) -> None:
    database = sqlite3.connect("run.db3")
    database.execute(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)"
    )
    database.execute("INSERT INTO topics VALUES (1, '/number', 'std_msgs/msg/Int32', 'cdr')")
    database.execute(
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
    )
    rows = [(number, b"\0\1\0\0" + struct.pack("<i", number)) for number in range(5000)]
    database.executemany("INSERT INTO messages VALUES (NULL, 1, ?, ?)", rows)
    database.commit()
    database.close()
    content = Path("run.db3").read_bytes()
    Path("run.db3").write_bytes(content[: len(content) // 2])

    assert main(["info", "run.db3"]) == 1
    assert "Run rosbag reindex" in capsys.readouterr().err
    assert main(["reindex", "run.db3"]) == 0

    assert "rows of the table messages: " in capsys.readouterr().err
    found = numbers("run.db3")
    assert found == list(range(len(found)))
    assert len(found) > 1000
