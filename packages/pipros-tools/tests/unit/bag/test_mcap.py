import os
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as LibraryWriter
from sensor_msgs.msg import Image
from std_msgs.msg import String

from pipros.basics.extras import install_command
from pipros.msg import dynamic
from pipros.msg.errors import DeserializationError
from pipros_tools.bag import BagError
from pipros_tools.bag.connection import StoredMessage, received_connection
from pipros_tools.bag.mcap_files import MAX_CONNECTIONS, McapWriter
from pipros_tools.bag.mcap_repair import recover
from pipros_tools.bag.opening import open_bag
from pipros_tools.bag.options import FileOptions
from pipros_tools.bag.record_files import RecordFiles
from pipros_tools.bag.rewrite import copy_chosen
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, rows_of, some_rows, values

ROWS = some_rows()


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes(ROWS, chunk_bytes=300))
    return path


def contents(path: str, **options: Any) -> list[Any]:
    with open_bag(path) as reader:
        return rows_of(reader, **options)


@pytest.mark.parametrize("compression", ["", "none", "lz4", "zstd"])
def test_a_bag_becomes_mcap_and_a_bag_again(compression: str, bag: Path) -> None:
    assert main(["convert", "--compression", compression, "run.bag", "run.mcap"]) == 0
    assert main(["convert", "run.mcap", "again.bag"]) == 0

    assert contents("run.mcap") == contents("again.bag") == values(ROWS)
    with open_bag("run.bag") as before, open_bag("again.bag") as after:
        assert [each.header for each in after.connections] == [each.header for each in before.connections]
    assert contents("run.mcap", topics="/a", start=11.0, end=11.000002) == [
        row for row in values(ROWS) if row[0] == "/a" and (11, 0) <= row[2:] <= (11, 2000)
    ]


def test_the_file_is_what_the_mcap_library_expects(bag: Path) -> None:
    main(["convert", "run.bag", "run.mcap"])

    with open("run.mcap", "rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros1"
        found = [(schema, channel, message) for schema, channel, message in reader.iter_messages()]
    schema, channel, message = found[1]
    assert len(found) == len(ROWS)
    assert (schema.name, schema.encoding, schema.data.decode()) == (
        "std_msgs/String", "ros1msg", String._full_text
    )  # fmt: skip
    assert (channel.topic, channel.message_encoding, channel.metadata["md5sum"]) == (
        "/b", "ros1", String._md5sum
    )  # fmt: skip
    assert (message.log_time, message.data) == (10_000_001_000, b"\x06\0\0\0text 1")


def test_many_are_converted_at_once_and_none_is_overwritten(bag: Path, capsys) -> None:
    Path("two.bag").write_bytes(bag.read_bytes())

    assert main(["convert", "--output-dir=out", "run.bag", "two.bag"]) == 0
    assert sorted(os.listdir("out")) == ["run.mcap", "two.mcap"]
    assert main(["convert", "run.bag", "out/run.mcap"]) == 1
    assert "already exists; --force overwrites it" in capsys.readouterr().err
    assert main(["convert", "-f", "run.bag", "out/two.mcap"]) == 0
    for options in ([], ["-f"]):
        assert main(["convert", *options, "run.bag", "run.bag"]) == 1
        assert "run.bag is the input" in capsys.readouterr().err


def test_info_and_filter_take_mcap(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["convert", "run.bag", "run.mcap"])

    assert main(["info", "--freq", "run.mcap"]) == 0
    told = capsys.readouterr().out
    assert "version:      mcap\n" in told
    assert "messages:     30\n" in told
    assert "zstd [1/1 chunks; " in told
    assert "15 msgs @ 500.0 kHz : std_msgs/Int32" in told
    assert main(["filter", "run.mcap", "some.mcap", "topic == '/a'"]) == 0
    assert main(["filter", "run.mcap", "some.bag", "topic == '/a'"]) == 0
    assert contents("some.mcap") == contents("some.bag") == [row for row in values(ROWS) if row[0] == "/a"]


def test_a_recording_can_be_mcap(bag: Path) -> None:
    recording = RecordFiles(FileOptions(name="new.mcap"), lambda _: None)
    recording.open(5 * 10**9)
    header = {"type": "std_msgs/String", "md5sum": String._md5sum, "message_definition": String._full_text}
    recording.write(StoredMessage(received_connection("/a", header), 5 * 10**9 + 6, b"\x02\0\0\0hi"))
    recording.close()

    assert contents("new.mcap") == [("/a", "hi", 5, 6)]


@pytest.mark.parametrize("chunk_bytes", [1, 1_000_000])
@pytest.mark.parametrize("index_types", [IndexType.ALL, IndexType.CHUNK])
def test_large_messages_stay_as_they_are_while_later_ones_are_read(
    index_types: IndexType, chunk_bytes: int, tmp_path: Path
) -> None:
    messages = [Image(data=bytes([n]) * (200_000 + n % 2)) for n in range(9)]
    path = tmp_path / "images.mcap"
    with path.open("wb") as file:
        writer = LibraryWriter(
            file, chunk_size=chunk_bytes, compression=CompressionType.NONE, index_types=index_types
        )
        writer.start(profile="ros1")
        schema = writer.register_schema("sensor_msgs/Image", "ros1msg", Image._full_text.encode())
        channel = writer.register_channel("/camera", "ros1", schema, {"md5sum": Image._md5sum})
        for number, message in enumerate(messages):
            encoded = BytesIO()
            message.serialize(encoded)
            writer.add_message(channel, number, encoded.getvalue(), number)
        writer.finish()

    with open_bag(path) as reader:
        assert [each.message for each in reader] == messages
        stored = list(reader.stored_messages())
        assert [reader.decode(each) for each in stored] == messages
    assert {type(each.data) for each in stored} == {bytes}


def test_a_damaged_file_is_an_error(bag: Path) -> None:
    main(["convert", "run.bag", "run.mcap"])
    whole = Path("run.mcap").read_bytes()
    for size in range(8, len(whole), 13):
        Path("cut.mcap").write_bytes(whole[:size])
        with pytest.raises(BagError):
            contents("cut.mcap")


def test_without_the_library_it_says_what_to_install(bag: Path, monkeypatch, capsys) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mcap.reader", None)

    assert main(["convert", "run.bag", "run.mcap"]) == 1
    assert install_command("mcap") in capsys.readouterr().err
    assert os.listdir() == ["run.bag"]


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_reindex_restores_messages_before_the_damage(compression: str, bag: Path, capsys) -> None:
    main(["convert", "--compression", compression, "run.bag", "run.mcap"])
    with open("some.mcap", "w+b") as file, open_bag("run.bag") as reader:
        copy_chosen(reader, McapWriter(file, compression=compression, chunk_bytes=200), None, lambda _: None)
    whole = Path("some.mcap").read_bytes()
    counts = set()
    for size in range(40, len(whole), 97):
        Path("cut.mcap").write_bytes(whole[:size])
        Path("cut.orig.mcap").unlink(missing_ok=True)
        assert main(["info", "cut.mcap"]) == 1
        assert "ERROR bag unindexed: cut.mcap.  Run rosbag reindex." in capsys.readouterr().err
        assert main(["reindex", "cut.mcap"]) == 0
        found = contents("cut.mcap")
        assert found == values(ROWS)[: len(found)]
        counts.add(len(found))
    assert len(counts) > 3
    assert max(counts) == len(ROWS)


def test_a_flipped_byte_is_an_error_or_leaves_the_other_messages(bag: Path) -> None:
    main(["convert", "--compression", "none", "run.bag", "run.mcap"])
    whole = bytearray(Path("run.mcap").read_bytes())
    refused = 0
    for at in range(0, len(whole), 7):
        whole[at] ^= 0x10
        Path("bad.mcap").write_bytes(whole)
        whole[at] ^= 0x10
        try:
            assert len(contents("bad.mcap")) <= len(ROWS)
        except BagError:
            refused += 1
        except DeserializationError:
            refused += 1
    assert refused > 20


def test_a_chunk_is_not_decompressed_beyond_its_claimed_size(bag: Path) -> None:
    for compression in ("lz4", "zstd"):
        main(["convert", "-f", "--compression", compression, "run.bag", "run.mcap"])
        whole = Path("run.mcap").read_bytes()
        with open_bag("run.mcap") as reader:
            size = reader.chunk_header(0).size.to_bytes(8, "little")
        for wrong in (10, 1 << 40):
            Path("bad.mcap").write_bytes(whole.replace(size, wrong.to_bytes(8, "little")))
            with pytest.raises(BagError, match=r"must be|damaged"):
                contents("bad.mcap")


def test_files_without_chunks_are_read_and_messages_of_ros_2_refused(bag: Path) -> None:
    for encoding, schema_encoding in (("ros1", "ros1msg"), ("cdr", "ros2msg")):
        with open("bare.mcap", "wb") as file:
            writer = LibraryWriter(file, use_chunking=False)
            writer.start(profile=encoding, library="x")
            schema = writer.register_schema("std_msgs/String", schema_encoding, b"string data")
            channel = writer.register_channel("/a", encoding, schema)
            for time in (3, 1, 2):
                writer.add_message(channel, time, b"\x01\0\0\0%d" % time, time)
            writer.finish()
        if encoding == "ros1":
            assert contents("bare.mcap") == [("/a", str(time), 0, time) for time in (1, 2, 3)]
            with open_bag("bare.mcap") as reader:
                assert reader.connections[0].md5sum == String._md5sum
        else:
            with pytest.raises(BagError, match=r"encoding ros1 .*, got cdr with ros2msg .ROS 2 messages"):
                contents("bare.mcap")


def test_an_unfinished_recording_can_be_read(bag: Path) -> None:
    recording = RecordFiles(FileOptions(name="new.mcap", chunk_bytes=100), lambda _: None)
    recording.open(5 * 10**9)
    header = {"type": "std_msgs/String", "md5sum": String._md5sum, "message_definition": String._full_text}
    connection = received_connection("/a", header)
    for number in range(50):
        recording.write(StoredMessage(connection, 5 * 10**9 + number, b"\x02\0\0\0%02d" % number))
    recording.flush()
    found = contents_of_active(Path("new.mcap.active"))
    recording.close()

    assert found == [f"{number:02d}" for number in range(len(found))]
    assert len(found) > 30


def contents_of_active(path: Path) -> list[str]:
    """Return the texts in a file that another program may still write."""
    with open("copy.mcap", "w+b") as file:
        recover(path, file, lambda _: None)
    return [row[1] for row in contents("copy.mcap")]


def test_a_file_with_too_many_connections_is_completed_without_the_surplus(tmp_path: Path) -> None:
    path = tmp_path / "many.mcap"
    with path.open("w+b") as file:
        writer = McapWriter(file)
        header = {"type": b"std_msgs/String", "md5sum": String._md5sum.encode()}
        for number in range(MAX_CONNECTIONS):
            writer.add_connection(f"/topic{number}", header)
        with pytest.raises(BagError, match="an MCAP file can have at most 65535 connections"):
            writer.add_connection("/surplus", header)
        writer.finish()
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert len(summary.channels) == MAX_CONNECTIONS


def test_the_definition_of_many_channels_is_compiled_once(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "many.mcap"
    with path.open("wb") as file:
        writer = LibraryWriter(file)
        writer.start("ros1")
        schema = writer.register_schema("a_robot/Level", "ros1msg", b"int32 level\n")
        for number in range(20):
            channel = writer.register_channel(f"/level_{number}", "ros1", schema)
            writer.add_message(channel, 1, bytes([number, 0, 0, 0]), 1)
        writer.finish()
    compiled: list[str] = []
    original = dynamic.message_source

    def counted(spec: Any, *args: Any) -> Any:
        compiled.append(spec.name)
        return original(spec, *args)

    monkeypatch.setattr(dynamic, "message_source", counted)

    with open_bag(path) as reader:
        levels = [message.level for _, message, *_ in reader.messages()]

    assert sorted(levels) == [*range(20)]
    assert compiled == ["Level"]


def test_sequence_numbers_and_publish_times_are_noted_as_they_are_read(tmp_path: Path) -> None:
    path, file = tmp_path / "run.mcap", BytesIO()
    writer: Any = LibraryWriter(file, compression=CompressionType.NONE)
    writer.start(profile="ros1", library="x")
    schema = writer.register_schema("std_msgs/String", "ros1msg", String._full_text.encode())
    channel = writer.register_channel("/a", "ros1", schema, {"md5sum": String._md5sum})
    writer.add_message(channel, 5, bytes(4), 5)
    writer.add_message(channel, 9, bytes(4), 7, sequence=3)
    writer.finish()

    path.write_bytes(file.getvalue())
    with open_bag(path) as bag:
        messages = bag.stored_fields()
        next(messages)
        assert bag.origins == {}
        next(messages)
        assert bag.origins == {"sequence numbers": True, "publish times": True}
