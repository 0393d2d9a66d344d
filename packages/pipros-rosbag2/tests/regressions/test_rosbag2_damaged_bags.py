"""rosbag2: damaged and old bags were unreadable, or lost messages in silence."""

import io
import os
import sqlite3
import struct
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from mcap.writer import CompressionType, Writer
from rosgraph_msgs.msg import Log
from std_msgs.msg import Int32
from tf2_msgs.msg import TFMessage

import rosbag
import rospy
from pipros_rosbag2.bags.reader import open_any_bag
from pipros_tools.bag import BagWriter
from pipros_tools.cli.rosbag import main
from tests.support.bags import header_of

TABLES = """
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
INSERT INTO topics VALUES (1, '/number', 'std_msgs/msg/Int32', 'cdr');
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
"""


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def cdr(number: int) -> bytes:
    return b"\0\1\0\0" + struct.pack("<i", number)


def write_database(*rows: tuple[int, object]) -> None:
    """Write run.db3 with messages of these topics and times, whose numbers count from 0."""
    with closing(sqlite3.connect("run.db3")) as database:
        database.executescript(TABLES)
        values = [(*row, cdr(number)) for number, row in enumerate(rows)]
        database.executemany("INSERT INTO messages VALUES (NULL, ?, ?, ?)", values)
        database.commit()


def mcap_of(times: Iterable[int], profile: str = "ros2", chunk_size: int = 1) -> bytes:
    """Return an MCAP file with messages of these times, whose numbers count from 0."""
    file, is_ros1 = io.BytesIO(), profile == "ros1"
    writer = Writer(file, chunk_size=chunk_size, compression=CompressionType.NONE)
    writer.start(profile=profile, library="x")
    name = "std_msgs/Int32" if is_ros1 else "std_msgs/msg/Int32"
    schema = writer.register_schema(name, f"{profile}msg", b"int32 data")
    channel = writer.register_channel("/number", "ros1" if is_ros1 else "cdr", schema)
    for number, time in enumerate(times):
        writer.add_message(channel, time, cdr(number)[4 if is_ros1 else 0 :], time)
    writer.finish()
    return file.getvalue()


def numbers(path: str) -> list[int]:
    with open_any_bag(path) as bag:
        return [message.data for _, message, *_ in bag.messages()]


# A message with an impossible time closed its bag, or was lost in silence.


@pytest.mark.parametrize("time", [-5, 2**32 * 10**9, 2**63 - 1, "noon"])
def test_a_message_with_an_impossible_time_is_left_out_with_a_warning(
    time: object, capsys: pytest.CaptureFixture[str]
) -> None:
    write_database((1, 1), (1, time), (1, 3))
    assert main(["info", "run.db3"]) == 0
    assert "messages:    3\n" in capsys.readouterr().out
    assert main(["convert", "run.db3", "out.bag"]) == 1
    assert "WARNING: messages on /number are left out: timestamps must be from 0" in capsys.readouterr().err
    assert numbers("out.bag") == [0, 2]


@pytest.mark.parametrize("profile", ["ros1", "ros2"])
def test_it_is_left_out_of_mcap_files_too(profile: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("run.mcap").write_bytes(mcap_of((1, 2**63, 3), profile, chunk_size=1000))
    assert main(["convert", "run.mcap", "out.bag"]) == 1
    assert "WARNING: messages on /number are left out: timestamps must be from 0" in capsys.readouterr().err
    assert numbers("out.bag") == [0, 2]


def test_messages_of_a_topic_that_the_file_does_not_name_are_reported(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_database((1, 1), (77, 2), (1, 3))
    assert main(["convert", "run.db3", "out.bag"]) == 1
    assert "WARNING: topic 77 is left out: the file has messages on it" in capsys.readouterr().err
    assert numbers("out.bag") == [0, 2]


# After a power failure, a file lacks its summary; each tool refers users to another one.


def test_the_advice_for_a_cut_mcap_file_leads_to_its_messages(capsys: pytest.CaptureFixture[str]) -> None:
    content = mcap_of(range(9))
    Path("cut.mcap").write_bytes(content[: content.rindex(struct.pack("<i", 7)) - 3])
    assert main(["info", "cut.mcap"]) == 1
    assert "Run rosbag reindex" in capsys.readouterr().err
    assert main(["reindex", "cut.mcap"]) == 0
    assert numbers("cut.mcap")[:7] == [0, 1, 2, 3, 4, 5, 6]
    assert main(["info", "cut.mcap"]) == 0
    assert "version:     ROS 2 jazzy, mcap" in capsys.readouterr().out


def test_a_cut_file_of_a_split_recording_does_not_hide_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    Path("run").mkdir()
    Path("run/run_0.mcap").write_bytes(mcap_of(range(3)))
    Path("run/run_1.mcap").write_bytes(mcap_of(range(5))[:-50])
    assert main(["info", "run"]) == 1
    assert "run/run_1.mcap" in capsys.readouterr().err
    assert numbers("run") == [0, 1, 2]
    assert main(["reindex", "run/run_1.mcap"]) == 0
    assert sorted(numbers("run")) == [0, 0, 1, 1, 2, 2, 3, 4]  # the copy run_1.orig.mcap is not read


def test_a_cut_database_keeps_its_first_messages(capsys: pytest.CaptureFixture[str]) -> None:
    write_database(*((1, time) for time in range(5000)))
    content = Path("run.db3").read_bytes()
    Path("run.db3").write_bytes(content[: len(content) // 2])
    assert main(["info", "run.db3"]) == 1
    assert "Run rosbag reindex" in capsys.readouterr().err
    assert main(["reindex", "run.db3"]) == 0
    assert "rows of the table messages: " in capsys.readouterr().err
    found = numbers("run.db3")
    assert found == list(range(len(found)))
    assert len(found) > 1000


# Bags before Hydro have tf/tfMessage, which no ROS 2 has; converted bags were useless.


@pytest.mark.parametrize("is_same", [True, False])
def test_renamed_types_get_their_later_names_if_they_are_the_same(is_same: bool) -> None:
    transforms = TFMessage([TransformStamped(child_frame_id="laser")])
    messages: list[tuple[str, str, Any]] = [
        ("/tf", "tf/tfMessage", transforms),
        ("/rosout", "roslib/Log", Log(msg="x")),
    ]
    with open("old.bag", "w+b") as file:
        writer = BagWriter(file)
        for topic, name, message in messages:
            header = {**header_of(message, topic), "type": name.encode()}
            if not is_same:
                header |= {"message_definition": b"int32 own", "md5sum": b"1" * 32}
            writer.write_message(writer.add_connection(topic, header), 1, 0, message)
        writer.finish()
    assert main(["convert", "--ros2", "humble", "old.bag", "new"]) == 0
    (path,) = Path("new").glob("*.db3")
    with closing(sqlite3.connect(path)) as database:
        found = dict(database.execute("SELECT name, type FROM topics"))
    if not is_same:
        assert not {"tf2_msgs/msg/TFMessage", "rcl_interfaces/msg/Log"} & set(found.values())
        return
    assert found == {"/tf": "tf2_msgs/msg/TFMessage", "/rosout": "rcl_interfaces/msg/Log"}
    with open_any_bag("new") as bag:
        by_topic = {topic: message for topic, message, *_ in bag.messages()}
    assert (by_topic["/tf"].transforms[0].child_frame_id, by_topic["/rosout"].msg) == ("laser", "x")


# An empty metadata.yaml, or one with old names of files, made a bag unreadable.


@pytest.mark.parametrize("fault", ["empty", "cut", "a list", "binary", "too large", "renamed file"])
def test_the_files_of_a_bag_with_unusable_metadata_are_read(
    fault: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with rosbag.Bag("first.bag", "w") as bag:
        bag.write("/number", Int32(7), rospy.Time(1))
    assert main(["convert", "--ros2", "humble", "first.bag", "run"]) == 0
    metadata = Path("run/metadata.yaml")
    content = metadata.read_bytes()
    contents = {"empty": b"", "cut": content[:90], "a list": b"- 1\n", "binary": b"\xff"}
    metadata.write_bytes(contents.get(fault, content))
    if fault == "too large":
        os.truncate(metadata, 1 << 32)
    if fault == "renamed file":
        Path("run/run_0.db3").rename("run/monday.db3")
    capsys.readouterr()
    assert main(["convert", "run", "out.bag"]) == 1
    warning = capsys.readouterr().err
    assert str(metadata) in warning
    assert "all files in the folder are read instead" in warning
    assert numbers("out.bag") == [7]
