"""Reported faults of rosbag."""

import io
import struct
import threading
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import Imu
from std_msgs.msg import Int32, String, UInt8

import rosbag
import rospy
from genpy import SerializationError
from pipros.master.master import Master
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.digest import SEPARATOR
from pipros_tools.bag import BagReader, BagWriter, contents
from pipros_tools.bag.options import FileOptions, RecordOptions
from pipros_tools.bag.recorder import Recorder
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, header_of, rows_of, some_rows, values
from tests.support.nodes import MakeNode, wait_until_connected
from tests.support.ros import RosSystem

# rosbag: a bag whose file header has another size than rosbag's was destroyed by reindex and appending. The
# format leaves the padding of the file header to the writer. rosbags (PyPI) pads header and data to 4,096
# bytes, rosbag the two without their lengths.


ROWS = some_rows(12)
OTHER_PADDING = [4011, 0, 9000]


def bag_with_padding(padding: int, *, is_indexed: bool = True) -> bytes:
    """Return a bag whose file header has `padding` bytes of data."""
    usual = bag_bytes(ROWS, chunk_bytes=150)
    start = 17 + int.from_bytes(usual[13:17], "little")
    size = int.from_bytes(usual[start : start + 4], "little")
    layout = BagReader(io.BytesIO(usual)).layout
    moved = padding - size
    bag = bytearray(usual[:start] + struct.pack("<I", padding) + b" " * padding + usual[start + 4 + size :])
    index = layout.index_position + moved
    at = bag.index(b"index_pos=") + 10
    bag[at : at + 8] = struct.pack("<Q", index if is_indexed else 0)
    at = index
    while (at := bag.find(b"chunk_pos=", at) + 10) > 9:
        (position,) = struct.unpack_from("<Q", bag, at)
        struct.pack_into("<Q", bag, at, position + moved)
    return bytes(bag if is_indexed else bag[:index])


@pytest.mark.parametrize("padding", OTHER_PADDING)
@pytest.mark.parametrize("is_indexed", [True, False])
def test_reindex_keeps_all_messages(tmp_path: Path, padding: int, is_indexed: bool) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(bag_with_padding(padding, is_indexed=is_indexed))
    assert main(["reindex", "-q", str(path)]) == 0
    with BagReader(path) as bag:
        assert rows_of(bag) == values(ROWS)


@pytest.mark.parametrize("padding", OTHER_PADDING)
def test_appending_keeps_all_messages(tmp_path: Path, padding: int) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(bag_with_padding(padding))
    with rosbag.Bag(str(path), "a") as bag:
        bag.write("/new", Int32(7), rospy.Time(99))
    with BagReader(path) as bag:
        assert rows_of(bag) == [*values(ROWS), ("/new", 7, 99, 0)]


def test_a_file_header_with_a_damaged_length_does_not_hide_the_chunks(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    damaged = bytearray(bag_bytes(ROWS))
    start = 17 + int.from_bytes(damaged[13:17], "little")
    damaged[start : start + 4] = b"\xff\xff\xff\x7f"
    path.write_bytes(damaged)
    assert main(["reindex", "-q", str(path)]) == 0
    with BagReader(path) as bag:
        assert rows_of(bag) == values(ROWS)


# rosjava, roslibpy: recorded definitions lack std_msgs/Header, so that tools refuse the topic or the bag.


def test_a_type_without_the_definition_of_its_header_is_read(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    header = Imu._full_text[Imu._full_text.index(SEPARATOR) :].split(SEPARATOR)[1]
    text = "Header header\nint32 level\n"
    made = message_classes_from_text("own/Level", f"{text}{SEPARATOR}{header}")["own/Level"]
    with open("run.bag", "w+b") as file:
        writer = BagWriter(file)
        fields = {**header_of(made(), "/level"), "message_definition": text.encode()}
        connection = writer.add_connection("/level", fields)
        writer.write_message(connection, 5, 0, made(level=7))
        writer.finish()

    assert main(["table", "run.bag", "/level", "-o", "level.csv"]) == 0
    assert main(["export", "run.bag", "out"]) == 0
    assert Path("level.csv").read_text().splitlines()[1].endswith(",7")
    assert Path("out/level.csv").read_text().splitlines()[1].endswith(",7")
    assert (main(["filter", "run.bag", "few.bag", "m.level == 7"]), capsys.readouterr().err) == (0, "")


# rosbag: an invalid message spoiled those written after it, and a look at the messages so far the bag.


def written_values(bag: Any) -> list[int]:
    return [message.data for _, message, _ in bag.read_messages()]


def test_messages_after_an_invalid_one_are_written(tmp_path: Path) -> None:
    path = str(tmp_path / "run.bag")
    with rosbag.Bag(path, "w") as bag:
        bag.write("/a", UInt8(1), rospy.Time(1))
        for topic, message in (("/a", UInt8(300)), ("/a", None), ("/a", "x"), ("/b", String(5))):
            with pytest.raises((ValueError, AttributeError, SerializationError)):
                bag.write(topic, message, rospy.Time(2))
        for value in (3, 4):
            bag.write("/a", UInt8(value), rospy.Time(value))
    with rosbag.Bag(path) as bag:
        assert written_values(bag) == [1, 3, 4]


def test_a_bag_can_be_read_while_it_is_written(tmp_path: Path) -> None:
    path = str(tmp_path / "run.bag")
    with rosbag.Bag(path, "w") as bag:
        for value in (1, 2, 3):
            bag.write("/a", UInt8(value), rospy.Time(value))
            assert (written_values(bag), bag.get_message_count()) == ([*range(1, value + 1)], value)
    with rosbag.Bag(path) as bag:
        assert written_values(bag) == [1, 2, 3]


def test_the_first_and_the_last_time_are_kept(tmp_path: Path) -> None:
    path = str(tmp_path / "run.bag")
    times = [rospy.Time(0), rospy.Time(0, 1), rospy.Time(2**32 - 1, 999_999_999)]
    with rosbag.Bag(path, "w") as bag:
        for time in times:
            bag.write("/a", UInt8(1), time)
    with rosbag.Bag(path) as bag:
        assert [time for _, _, time in bag.read_messages()] == times
        assert (bag.get_start_time(), bag.get_end_time()) == (0.0, 2.0**32)


# rosbag, rostopic: a topic that was given twice was recorded twice, or counted at twice its rate.


def test_each_message_is_recorded_once(make_node: MakeNode, tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    node, publisher = make_node("record"), make_node("talker").advertise("/number", Int32, queue_size=None)
    files = FileOptions(name=str(path))
    options = RecordOptions(topics=("/number", "number", "/number"), limit=4, files=files)
    said: list[Any] = []
    recording = threading.Thread(target=Recorder(node, options, say=said.append, warn=said.append).run)
    recording.start()
    wait_until_connected(publisher)
    for number in range(4):
        publisher.publish(Int32(number))
    recording.join(30)
    with BagReader(path) as bag:
        assert [row[:2] for row in rows_of(bag)] == [("/number", number) for number in range(4)]
    assert said.count("Subscribing to /number") == 1


def test_the_rate_is_that_of_the_topic(make_node: MakeNode, ros: RosSystem, master: Master) -> None:
    publisher = make_node("talker").advertise("/number", Int32)
    measuring = ros.pipros.start("rostopic", "hz", "/number", "number", ROS_MASTER_URI=master.uri)
    wait_until_connected(publisher)
    assert publisher.connection_count == 1
    measuring.press_ctrl_c(code=0)
    assert measuring.stdout.count("subscribed to [/number]") == 1


# rosbag: exporting a bag took a pass over the whole bag for each topic, hours for long recordings.


@pytest.mark.parametrize("topics", [3, 300])
def test_each_chunk_is_read_once(topics: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rows: list[Any] = [(f"/t{number % topics}", Int32(number), number, 0) for number in range(600)]
    Path("run.bag").write_bytes(bag_bytes(rows, chunk_bytes=5000))
    reads: list[int] = []
    read_chunk_index = contents.read_chunk_index

    def counted(*arguments: Any) -> Any:
        reads.append(arguments[2].position)
        return read_chunk_index(*arguments)

    monkeypatch.setattr(contents, "read_chunk_index", counted)
    assert main(["export", "run.bag", "out"]) == 0

    assert len(set(reads)) > 3
    assert len(reads) == len(set(reads))
    assert [len(path.read_text().splitlines()) for path in Path("out").iterdir()] == [
        600 // topics + 1
    ] * topics
