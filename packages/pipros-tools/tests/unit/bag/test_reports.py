"""Cases that users of bags reported: nothing is lost, mixed or changed without a word."""

import zlib
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from sensor_msgs.msg import Imu
from std_msgs.msg import Empty, Int32, String

import rosbag
import rospy
from pipros_tools.bag import BagError, BagReader, BagWriter, open_bag
from pipros_tools.bag.mcap_files import McapWriter
from pipros_tools.bag.records import MAGIC, U32, field_bytes
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, header_of, some_rows

NO_DEFINITION = {"message_definition": "", "md5sum": "d41d8cd98f00b204e9800998ecf8427e"}


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def write_bag(*messages: tuple[str, Any, dict[str, Any]], path: str = "run.bag") -> None:
    """Write messages, each with its own connection, whose header has the given fields."""
    with open(path, "w+b") as file:
        writer = BagWriter(file)
        for number, (topic, message, more) in enumerate(messages):
            connection = writer.add_connection(topic, {**header_of(message, topic), **more})
            writer.write_message(connection, 10, number, message)
        writer.finish()


@pytest.mark.parametrize("no_limit", [None, rospy.Time(0), 0])
def test_a_time_of_zero_is_no_limit(no_limit: Any) -> None:
    write_bag(("/a", Int32(1), {}), ("/a", Int32(2), {}))
    with rosbag.Bag("run.bag") as bag:
        found = bag.read_messages(start_time=no_limit, end_time=no_limit)
        assert [each.message.data for each in found] == [1, 2]


def encrypted() -> bytes:
    data = bag_bytes(some_rows(4))
    size = int.from_bytes(data[len(MAGIC) : len(MAGIC) + 4], "little")
    end = len(MAGIC) + 8 + size
    padding = int.from_bytes(data[end - 4 : end], "little")
    more = field_bytes({"encryptor": b"rosbag/AesCbcEncryptor"})
    header = data[len(MAGIC) + 4 : end - 4] + more
    parts = (
        MAGIC, U32.pack(len(header)), header, U32.pack(padding - len(more)), b" " * (padding - len(more)),
    )  # fmt: skip
    return b"".join(parts) + data[end + padding :]


@pytest.mark.parametrize("command", ["info", "reindex", "compress"])
def test_an_encrypted_bag_stays_as_it_is(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = Path("run.bag")
    path.write_bytes(encrypted())

    assert main([command, "run.bag"]) == 1

    assert "run.bag is encrypted; pipros cannot read encrypted bags" in capsys.readouterr().err
    assert [each.read_bytes() for each in Path().iterdir()] == [encrypted()]
    with pytest.raises(BagError, match="encrypted"):
        BagReader("run.bag", rebuild_index=True)


@pytest.mark.parametrize(("start", "name"), [
    (b"\x28\xb5\x2f\xfd", "zstd"), (b"\x1f\x8b\x08", "gzip"), (b"BZh9", "bzip2"), (b"PK\x03\x04", "zip")
])  # fmt: skip
def test_a_file_that_another_program_compressed_is_named(start: bytes, name: str, capsys) -> None:
    Path("run.db3.zstd").write_bytes(start + zlib.compress(bytes(500)))

    assert main(["info", "run.db3.zstd"]) == 1

    assert f"is compressed with {name}; decompress it first" in capsys.readouterr().err


@pytest.mark.parametrize("message", [Int32(0), String("")])
def test_a_message_whose_length_was_not_written_is_lost(message: Any) -> None:
    """After a power failure, the end of a file may consist of zeros."""
    data = bag_bytes([("/a", Int32(7), 1, 0), ("/b", message, 2, 0)], is_finished=False)
    end = data.rindex(b"time=") + len("time=") + 8
    Path("run.bag").write_bytes(data[:end] + bytes(200))

    assert main(["reindex", "-q", "run.bag"]) == 0

    with open_bag("run.bag") as bag:
        assert [each.message.data for each in bag] == [7]
        assert bag.start == bag.end == (1, 0)


def test_a_complete_message_of_zeros_or_without_data_is_kept() -> None:
    rows: list[Any] = [("/a", Empty(), 1, 0), ("/b", Int32(0), 2, 0)]
    data = bag_bytes(rows, is_finished=False)
    end = data.rindex(b"time=") + len("time=") + 8 + 4 + 4
    Path("run.bag").write_bytes(data[:end] + bytes(200))

    assert main(["reindex", "-q", "run.bag"]) == 0

    with open_bag("run.bag") as bag:
        assert [each.topic for each in bag] == ["/a", "/b"]


@pytest.mark.parametrize("header", [NO_DEFINITION, {**NO_DEFINITION, "md5sum": "*"}])
def test_an_empty_definition_stands_for_the_installed_type(header: Any) -> None:
    write_bag(("/imu", Imu(orientation_covariance=[2.0] * 9), header), ("/empty", Empty(), header))
    with open_bag("run.bag") as bag:
        imu, empty = (each.message for each in bag)
        assert isinstance(imu, Imu)
        assert imu.orientation_covariance == (2.0,) * 9
        assert empty.__slots__ == []


def test_an_empty_definition_of_an_unknown_type_is_an_error_unless_messages_are_empty() -> None:
    write_bag(("/a", Int32(1), {**NO_DEFINITION, "type": "mine/Unknown"}))
    with open_bag("run.bag") as bag, pytest.raises(BagError, match="no definition of mine/Unknown"):
        list(bag)
    write_bag(("/a", Empty(), {**NO_DEFINITION, "type": "mine/Unknown"}))
    with open_bag("run.bag") as bag:
        assert len(list(bag)) == 1


def test_a_message_that_is_not_of_the_installed_type_is_reported() -> None:
    write_bag(("/imu", Int32(1), {**NO_DEFINITION, "type": "sensor_msgs/Imu"}))
    bad: list[tuple[str, str]] = []
    with open_bag("run.bag") as bag:
        bag.on_bad_message = lambda *found: bad.append(found)
        assert list(bag) == []
    assert [topic for topic, _ in bad] == ["/imu"]


def test_a_connection_header_may_have_texts() -> None:
    more = {"callerid": "/node", "latching": "1"}
    for path in ("run.bag", "run.mcap"):
        write_bag(("/a", Int32(1), more))
        assert main(["convert", "-f", "run.bag", "run.mcap"]) == 0
        with open_bag(path) as bag:
            assert [(each.callerid, each.is_latching) for each in bag.connections] == [("/node", True)]


@pytest.mark.parametrize("command", ["compress", "reindex", "decompress"])
def test_the_output_folder_is_made(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    write_bag(("/a", Int32(1), {}))

    assert main([command, "-q", "--output-dir", "new/folder", "run.bag"]) == 0
    assert main([command, "--output-dir", "run.bag", "run.bag"]) == main([command, "."]) == 1

    told = capsys.readouterr().err
    assert told.startswith(f"ERROR: cannot {command}: File exists: 'run.bag'\nERROR reading .: it is ")
    with open_bag("new/folder/run.bag") as bag:
        assert bag.message_count == 1


def beside(path: str) -> tuple[list[Any], list[Any]]:
    with open(path, "rb") as file:
        reader = make_reader(file)
        return list(reader.iter_attachments()), list(reader.iter_metadata())


@pytest.mark.parametrize(("command", "keeps"), [
    (["convert", "run.mcap", "out.mcap"], True), (["filter", "run.mcap", "out.mcap", "topic == '/a'"], True),
    (["fix", "-n", "run.mcap", "out.mcap"], True), (["merge", "run.mcap", "run.bag", "-o", "out.mcap"], True),
    (["convert", "run.mcap", "out.bag"], False), (["filter", "run.mcap", "out.bag", "m.data < 3"], False),
    (["merge", "run.mcap", "-o", "out.bag"], False), (["split", "-q", "run.mcap", "--every", "1s"], True),
])  # fmt: skip
def test_attachments_and_metadata_are_kept_or_named(command: list[str], keeps: bool, capsys) -> None:
    Path("run.bag").write_bytes(bag_bytes([("/a", Int32(1), 1, 0)]))
    with open("run.mcap", "w+b") as file:
        writer = McapWriter(file)
        connection = writer.add_connection("/a", header_of(Int32(), "/a"))
        writer._writer.add_attachment(5, 6, "calibration.yaml", "text/yaml", b"fx: 1")
        writer.write_message(connection, 1, 0, Int32(2))
        writer._writer.add_metadata("weather", {"rain": "no"})
        writer.finish()
    before = beside("run.mcap")
    assert [len(each) for each in before] == [1, 1]

    assert main(command) == 0

    warning = "WARNING: run.mcap: 1 attachments and 1 metadata records are left out; the new file cannot "
    warning += "store them"
    assert capsys.readouterr().err == ("" if keeps else f"{warning}\n")
    if keeps:
        assert beside("run_0.mcap" if command[0] == "split" else "out.mcap") == before
