"""`import rosbag`. tests.interop compares both implementations on the same bags."""

import io
import pickle
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag1 import Reader as SecondReader
from std_msgs.msg import Int32, String

import genpy
import rosbag
import rospy
from tests.support.bags import bag_bytes, old_bag_bytes, some_rows, values


def written(path: Path, **options: Any) -> list[tuple[str, Any, int]]:
    with rosbag.Bag(str(path), "w", **options) as bag:
        for n in range(10):
            bag.write("/a", Int32(n), rospy.Time(n))
            bag.write("/b", String(f"text {n}"), genpy.Time(n, 1))
    return [row for n in range(10) for row in (("/a", n, n), ("/b", f"text {n}", n))]


def rows(bag: rosbag.Bag, **options: Any) -> list[tuple[str, Any, int]]:
    return [(topic, m.data, t.secs) for topic, m, t in bag.read_messages(**options)]


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_messages_survive_a_round_trip_and_another_library_reads_them(compression: str, tmp_path) -> None:
    path = tmp_path / "run.bag"
    expected = written(path, compression=compression, chunk_threshold=200)

    with rosbag.Bag(str(path)) as bag:
        assert rows(bag) == expected
        assert isinstance(next(iter(bag)).timestamp, rospy.Time)
    with SecondReader(path) as other:
        found = [(each.topic, stamp // 10**9, bytes(data)) for each, stamp, data in other.messages()]
    assert [(topic, time) for topic, time, _ in found] == [(topic, time) for topic, _, time in expected]
    assert found[1][2] == b"\x06\0\0\0text 0"


def test_messages_are_of_the_installed_classes(tmp_path: Path) -> None:
    written(tmp_path / "run.bag")

    with rosbag.Bag(str(tmp_path / "run.bag")) as bag:
        message = next(iter(bag)).message

    assert (type(message), message) == (Int32, Int32(0))


def test_raw_messages_can_be_copied(tmp_path: Path) -> None:
    expected = written(tmp_path / "in.bag")

    with rosbag.Bag(str(tmp_path / "in.bag")) as bag, rosbag.Bag(str(tmp_path / "out.bag"), "w") as out:
        for topic, raw, t, header in bag.read_messages(raw=True, return_connection_header=True):
            out.write(topic, raw, t, raw=True, connection_header=header)
            out.write("/short" + topic, (*raw[:3], raw[4]), t, raw=True)
    with rosbag.Bag(str(tmp_path / "out.bag")) as bag:
        assert (rows(bag, topics=["/a", "/b"]), bag.get_message_count()) == (expected, 40)
        assert bag.get_message_count("/a") == bag.get_message_count(["/short//a/"]) == 10
        assert (len(rows(bag, topics="")), list(bag.get_type_and_topic_info("//a").topics)) == (40, ["/a"])


def test_reading_while_writing_sees_what_was_written(tmp_path: Path) -> None:
    with rosbag.Bag(str(tmp_path / "run.bag"), "w") as bag:
        assert bag.get_message_count() == 0
        with pytest.raises(rosbag.ROSBagException, match="Bag contains no message"):
            bag.get_start_time()
        bag.write("/a", Int32(1), rospy.Time(5))
        assert rows(bag) == [("/a", 1, 5)]
        bag.write("/a", Int32(2), rospy.Time(6))
        assert (rows(bag), bag.get_end_time()) == ([("/a", 1, 5), ("/a", 2, 6)], 6.0)
    with rosbag.Bag(str(tmp_path / "run.bag")) as bag:
        assert rows(bag) == [("/a", 1, 5), ("/a", 2, 6)]


def test_a_different_type_or_header_gets_its_own_connection(tmp_path: Path) -> None:
    path = str(tmp_path / "run.bag")
    header = {"callerid": "/one", "latching": b"1"}
    with rosbag.Bag(path, "w") as bag:
        bag.write("/a", Int32(1), rospy.Time(1))
        # Genuine rosbag needs these lines, so grepros and bag editors have them.
        fields = {"type": String._type, "md5sum": String._md5sum, "message_definition": String._full_text}
        info = rosbag.bag._ConnectionInfo(1, "/a", fields | {"topic": "/a"})
        bag._write_connection_record(info, encrypt=False)
        bag._connections[1] = bag._topic_connections["/a"] = info
        bag.write("/a", String("x"), rospy.Time(2))
        bag.write("/a", Int32(3), rospy.Time(3), connection_header=header)
        bag.write("/a", Int32(4), rospy.Time(4), connection_header=dict(header))
    with rosbag.Bag(path) as bag:
        found = list(bag.read_messages(return_connection_header=True))
        assert bag.get_type_and_topic_info().topics["/a"].connections == 3

    assert [message.data for _, message, _, _ in found] == [1, "x", 3, 4]
    assert found[3].connection_header.items() >= {("callerid", b"/one"), ("type", b"std_msgs/Int32")}


def test_appending_adds_messages(tmp_path: Path) -> None:
    path = str(tmp_path / "run.bag")
    expected = written(Path(path), chunk_threshold=100)
    with rosbag.Bag(path, "a") as bag:
        assert rows(bag) == expected
        bag.write("/a", Int32(99), rospy.Time(99))
        assert bag.get_message_count() == 21

    with rosbag.Bag(path) as bag:
        assert rows(bag) == [*expected, ("/a", 99, 99)]
        assert bag.get_type_and_topic_info().topics["/a"].connections == 1


def test_an_unindexed_bag_is_reindexed_in_its_file(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    expected = written(path, chunk_threshold=200)
    with rosbag.Bag(str(path)) as bag:
        chunk_count = bag.get_compression_info().uncompressed
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.rindex(b"op=\x06") - 500])

    with pytest.raises(rosbag.ROSBagUnindexedException, match="Unindexed bag"):
        rosbag.Bag(str(path))
    with pytest.raises(rosbag.ROSBagUnindexedException):
        rosbag.Bag(str(path), "a")
    with rosbag.Bag(str(path), allow_unindexed=True) as bag:
        assert (bag.get_message_count(), rows(bag)) == (0, [])
        in_memory = list(bag.reindex()), rows(bag)
    assert path.stat().st_size == whole.rindex(b"op=\x06") - 500
    with rosbag.Bag(str(path), "a", allow_unindexed=True) as bag:
        positions = list(bag.reindex())
    assert positions == sorted(positions)
    assert positions[0] == 4117
    with rosbag.Bag(str(path)) as bag:
        found = rows(bag)
    assert chunk_count
    assert found == expected[: len(found)]
    assert in_memory == (positions, found)
    assert len(found) > 10


def test_bags_can_be_read_from_and_written_to_file_objects() -> None:
    file = io.BytesIO()
    closes = file.close
    file.close = lambda: None  # type: ignore[method-assign] # to read it afterwards
    with rosbag.Bag(file, "w") as bag:
        bag.write("/a", Int32(1), rospy.Time(5))
        assert (bag.filename, bag.mode, bag.version) == (None, "w", 200)
    with rosbag.Bag(file) as bag:
        assert rows(bag) == [("/a", 1, 5)]
        assert str(bag).startswith("version:     2.0\n")
    file.close = closes  # type: ignore[method-assign]
    bag = rosbag.Bag(io.BytesIO(bag_bytes(some_rows())))
    assert [(topic, value) for topic, value, _ in rows(bag)] == [row[:2] for row in values(some_rows())]
    bag.close()


def test_using_a_closed_bag_raises(tmp_path: Path) -> None:
    written(tmp_path / "run.bag")
    bag = rosbag.Bag(str(tmp_path / "run.bag"))
    bag.close()
    bag.close()

    for use in (bag.read_messages, bag.get_message_count, bag.flush, lambda: bag.size, lambda: str(bag)):
        with pytest.raises(ValueError, match="I/O operation on closed bag"):
            use()


@pytest.mark.parametrize(("arguments", "error", "words"), [
    ({"f": ""}, ValueError, "filename (or stream) is invalid"),
    ({"mode": "q"}, ValueError, 'mode "q" is invalid'),
    ({"compression": "zip"}, ValueError, "compression must be one of: none, bz2, lz4"),
    ({"chunk_threshold": -1}, ValueError, "chunk_threshold must be greater than or equal to zero"),
    ({"options": 3}, ValueError, "options must be of type dict"),
    ({"mode": "r"}, FileNotFoundError, "No such file"), ({"mode": "a"}, rosbag.ROSBagException, "empty file"),
])  # fmt: skip
def test_wrong_arguments_are_refused(
    arguments: dict[str, Any], error: type[Exception], words: str, tmp_path: Path
) -> None:
    with pytest.raises(error) as raised:
        rosbag.Bag(**{"f": str(tmp_path / "none.bag"), "mode": "w", **arguments})
    assert words in str(raised.value)


@pytest.mark.parametrize(("arguments", "error", "words"), [
    (("", Int32(1)), ValueError, "topic is invalid"), (("/a", None), ValueError, "msg is invalid"),
    (("/a", "text"), AttributeError, "no attribute 'serialize'"),
    (("/a", Int32(1), 5.0), TypeError, "t must be a rospy.Time"),
    (("/a", String(5)), genpy.SerializationError, "field data must be of type"),  # type: ignore[arg-type]
    (("/a", ("std_msgs/String", b""), None, True), ValueError, "msg must be of length 4 or 5"),
    (("/a", ("no/Type", b"", "0", None), None, True), rosbag.ROSBagException, "cannot locate"),
])  # fmt: skip
def test_wrong_messages_are_refused_and_leave_nothing(
    arguments: tuple[Any, ...], error: type[Exception], words: str, tmp_path: Path
) -> None:
    with rosbag.Bag(str(tmp_path / "run.bag"), "w") as bag:
        with pytest.raises(error) as raised:
            bag.write(*arguments)
        assert words in str(raised.value)
        assert bag.get_message_count() == 0


def test_reading_needs_times_of_ros(tmp_path: Path) -> None:
    written(tmp_path / "run.bag")
    with rosbag.Bag(str(tmp_path / "run.bag")) as bag:
        with pytest.raises(TypeError, match=r"start_time must be a rospy\.Time"):
            bag.read_messages(start_time=4.0)  # type: ignore[arg-type]
        with pytest.raises(io.UnsupportedOperation):
            bag.write("/a", Int32(1))
        assert rows(bag, start_time=rospy.Time(8), topics="//a/") == [("/a", 8, 8), ("/a", 9, 9)]
        assert rows(bag, topics=["a"]) == []
        assert rows(bag, topics=[]) == rows(bag)


def test_exceptions_can_be_pickled() -> None:
    for error in (rosbag.ROSBagException("x"), rosbag.ROSBagFormatException("y")):
        again = pickle.loads(pickle.dumps(error))  # noqa: S301
        assert (type(again), again.value) == (type(error), error.value)
    assert str(pickle.loads(pickle.dumps(rosbag.ROSBagUnindexedException()))) == "Unindexed bag"  # noqa: S301


def test_the_options_of_chunks_can_change(tmp_path: Path) -> None:
    with rosbag.Bag(str(tmp_path / "run.bag"), "w", options={"compression": "bz2"}) as bag:
        assert bag.options == {"compression": "bz2", "chunk_threshold": 786432}
        bag.write("/a", Int32(1), rospy.Time(1))
        bag.compression = rosbag.Compression.NONE
        bag.chunk_threshold = 5
        bag.write("/a", Int32(2), rospy.Time(2))
        bag.set_encryptor()
        with pytest.raises(rosbag.ROSBagEncryptNotSupportedException):
            bag.set_encryptor("rosbag/AesCbcEncryptor", "*")
    with rosbag.Bag(str(tmp_path / "run.bag")) as bag:
        assert "compression:  none [1/2 chunks], bz2 [1/2 chunks; " in str(bag)


@pytest.mark.parametrize("data", [bag_bytes(some_rows(), compression="bz2"), old_bag_bytes(some_rows())])
def test_viewers_go_back_and_forth_by_positions(data: bytes) -> None:
    bag = rosbag.Bag(io.BytesIO(data))
    entries = list(bag._get_entries_reverse())

    found = [bag._read_message(entry.position) for entry in reversed(entries)]
    assert [(each.topic, each.message.data) for each in found] == [row[:2] for row in values(some_rows())]
    assert bag._get_entry(rospy.Time(12), None).time == rospy.Time(12)
    assert bag._get_entry_after(rospy.Time(99)) is None
    wrong = (1, 1) if isinstance(entries[0].position, tuple) else 1
    with pytest.raises(rosbag.ROSBagException, match=r"there is no chunk|header must be"):
        bag._read_message(wrong)


def test_positions_are_those_of_written_bytes(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "run.bag", "w") as bag:
        for number in range(3):
            bag.write("/a", Int32(number), rospy.Time(number + 1))
            positions = [entry.position for entry in bag._get_entries()]
            assert [bag._read_message(each).message.data for each in positions] == list(range(number + 1))
        assert [each.datatype for each in bag._connections.values()] == ["std_msgs/Int32"]


def test_subcommands_are_functions(tmp_path: Path, monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    """`from rosbag.rosbag_main import decompress_cmd`, as jsk_data and others do."""
    from rosbag.rosbag_main import check_cmd, compress_cmd, decompress_cmd, filter_cmd, info_cmd, reindex_cmd

    monkeypatch.chdir(tmp_path)
    expected = written(tmp_path / "run.bag")
    for command, compression in ((compress_cmd, "bz2"), (decompress_cmd, "none"), (reindex_cmd, "none")):
        command(["-f", "-q", "run.bag"])
        with rosbag.Bag("run.bag") as bag:
            assert (rows(bag), bag.get_compression_info().compression) == (expected, compression)
    info_cmd(["run.bag"])
    check_cmd(["run.bag"])
    filter_cmd(["run.bag", "some.bag", "topic == '/a'"])
    assert "messages:    20" in capsys.readouterr().out
    with rosbag.Bag("some.bag") as bag:
        assert rows(bag) == [row for row in expected if row[0] == "/a"]
    with pytest.raises(SystemExit) as ended:
        info_cmd(["missing.bag"])
    assert ended.value.code == 1
    with pytest.raises(SystemExit) as ended:
        rosbag.rosbag_main.compress_cmd([])
    assert ended.value.code == 2


@pytest.mark.parametrize("compression", ["none", "bz2"])
def test_raw_messages_end_with_their_positions_in_the_file(compression: str, tmp_path: Path) -> None:
    written(path := tmp_path / "run.bag", compression=compression, chunk_threshold=100)

    with rosbag.Bag(str(path)) as bag:
        positions = [raw[3] for _, raw, _ in bag.read_messages(raw=True)]
        assert positions == [entry.position for entry in bag._get_entries()]
        assert len({chunk for chunk, _ in positions}) > 3
