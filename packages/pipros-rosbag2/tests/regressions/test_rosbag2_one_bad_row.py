"""rosbag2: a message with an impossible time closed its bag, or was lost in silence."""

from __future__ import annotations

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


def cdr(number: int) -> bytes:
    return b"\0\1\0\0" + struct.pack("<i", number)


def write_database(time: object, *, topic: int = 1) -> None:
    """Write run.db3 with messages 0, 1 and 2; 1 has the given time and topic."""
    database = sqlite3.connect("run.db3")
    database.execute(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)"
    )
    database.execute("INSERT INTO topics VALUES (1, '/number', 'std_msgs/msg/Int32', 'cdr')")
    database.execute(
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
    )
    rows = [(1, 1, cdr(0)), (topic, time, cdr(1)), (1, 3, cdr(2))]
    database.executemany("INSERT INTO messages VALUES (NULL, ?, ?, ?)", rows)
    database.commit()
    database.close()


def numbers(path: str) -> list[int]:
    with open_any_bag(path) as bag:
        return [message.data for _, message, *_ in bag.messages()]


@pytest.mark.parametrize("time", [-5, 2**32 * 10**9, 2**63 - 1, "noon"])
def test_a_message_with_an_impossible_time_is_left_out_with_a_warning(
    time: object, capsys: pytest.CaptureFixture[str]
) -> None:
    write_database(time)
    assert main(["info", "run.db3"]) == 0
    assert "messages:    3\n" in capsys.readouterr().out
    assert main(["convert", "run.db3", "out.bag"]) == 1
    assert "WARNING: messages on /number are left out: timestamps must be from 0" in capsys.readouterr().err
    assert numbers("out.bag") == [0, 2]


@pytest.mark.parametrize("profile", ["ros1", "ros2"])
def test_it_is_left_out_of_mcap_files_too(profile: str, capsys: pytest.CaptureFixture[str]) -> None:
    with open("run.mcap", "wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start(profile=profile, library="x")
        name, encoding = ("std_msgs/Int32", "ros1") if profile == "ros1" else ("std_msgs/msg/Int32", "cdr")
        schema = writer.register_schema(name, f"{profile}msg", b"int32 data")
        channel = writer.register_channel("/number", encoding, schema)
        for number, time in enumerate((1, 2**63, 3)):
            writer.add_message(channel, time, cdr(number)[0 if encoding == "cdr" else 4 :], time)
        writer.finish()
    assert main(["convert", "run.mcap", "out.bag"]) == 1
    assert "WARNING: messages on /number are left out: timestamps must be from 0" in capsys.readouterr().err
    assert numbers("out.bag") == [0, 2]


def test_messages_of_a_topic_that_the_file_does_not_name_are_reported(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_database(2, topic=77)
    assert main(["convert", "run.db3", "out.bag"]) == 1
    assert "WARNING: topic 77 is left out: the file has messages on it" in capsys.readouterr().err
    assert numbers("out.bag") == [0, 2]
