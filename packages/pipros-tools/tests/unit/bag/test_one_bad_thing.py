"""One bad thing among good ones, first, in the middle and last: only it is left out, with the reason."""

# needs the plugins: data, ros2

import io
import os
import sqlite3
import struct
from bisect import bisect
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as LibraryWriter
from sensor_msgs.msg import CompressedImage, Image, Imu
from std_msgs.msg import Int32, String

import rosbag
import rospy
from pipros.msg.dynamic import message_classes_from_text
from pipros_tools.bag import BagError, BagFormatError, BagWriter, open_bag
from pipros_tools.bag.merge import merged
from pipros_tools.bag.migration import rule_text
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, header_of, rows_of

Change = Callable[[dict[str, bytes]], object]
POSITIONS = (0, 1, 2)
POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 9\n"


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


@pytest.fixture(params=POSITIONS)
def bad(request: pytest.FixtureRequest) -> int:
    """The place of the bad one."""
    return int(request.param)


def names(bad: int, wrong: str = "") -> tuple[list[str], list[str]]:
    """Return all three topics, in order, and the two good ones. The bad one may have another name."""
    topics = [f"/{letter}" for letter in "ace"]
    good = [topic for number, topic in enumerate(topics) if number != bad]
    topics[bad] = wrong or topics[bad]
    return topics, good


def write_bag(bad: int, change: Change, data: bytes = b"", wrong: str = "") -> list[str]:
    """Write `run.bag` with three topics, of which `change` spoils the header of one. Return the good ones."""
    topics, good = names(bad, wrong)
    with open("run.bag", "w+b") as file:
        writer = BagWriter(file)
        for number, topic in enumerate(topics):
            header = header_of(Int32(), topic)
            if number == bad:
                change(header)
            connection = writer.add_connection(topic, header)
            for time in (1, 2):
                body = data if number == bad and data and time == 2 else struct.pack("<i", 10 * number + time)
                writer.write(connection, time, number, body)
        writer.finish()
    return good


def write_mcap(bad: int, encoding: str, schema: tuple[str, bytes] | None) -> list[str]:
    """Write `run.mcap` with three topics, one of them with another encoding. Return the good ones."""
    topics, good = names(bad)
    with open("run.mcap", "wb") as file:
        writer = LibraryWriter(file)
        writer.start(profile="ros1", library="x")
        for number, topic in enumerate(topics):
            kind = schema if number == bad else ("ros1msg", b"int32 data")
            schema_id = writer.register_schema("std_msgs/Int32", *kind) if kind else 0
            channel = writer.register_channel(topic, encoding if number == bad else "ros1", schema_id)
            for time in (1, 2):
                body = struct.pack("<i", 10 * number + time)
                writer.add_message(channel, time * 10**9 + number, body, 0)
        writer.finish()
    return good


SCHEMAS = {
    "json": ("json", ("jsonschema", b"{}")), "protobuf": ("protobuf", ("protobuf", b"\0")),
    "cbor": ("cbor", None), "broken": ("ros1", ("ros1msg", b"nothing x y")),
}  # fmt: skip


@pytest.mark.parametrize("kind", SCHEMAS)
def test_a_channel_that_cannot_be_read_affects_only_itself(kind: str, bad: int, capsys) -> None:
    good = write_mcap(bad, *SCHEMAS[kind])
    wrong = names(bad)[0][bad]

    assert main(["info", "run.mcap"]) == 0
    shown = capsys.readouterr()
    assert f"WARNING: {wrong} is left out: the " in shown.err
    assert f"left out:     {wrong}: the " in shown.out
    assert "messages:     4\n" in shown.out
    commands = {
        "bag": ["convert", "run.mcap", "out.bag"], "filter": ["filter", "run.mcap", "few.bag", "m.data > 0"],
        "check": ["check", "run.mcap"], "fix": ["fix", "run.mcap", "fixed.bag"],
        "export": ["export", "run.mcap", "out"], "all": ["table", "run.mcap", "/*", "-o", "all.csv"],
    }  # fmt: skip
    for name, command in commands.items():
        assert main(command) == 1, name
        assert f"WARNING: {wrong} is left out: the " in capsys.readouterr().err, name
    for path in ("out.bag", "few.bag", "fixed.bag"):
        with open_bag(path) as reader:
            assert [row[:2] for row in rows_of(reader)] == [
                (topic, 10 * names(bad)[0].index(topic) + time) for time in (1, 2) for topic in good
            ]
    assert sorted(os.listdir("out")) == [f"{topic[1:]}.csv" for topic in good]
    assert len(Path("all.csv").read_text().splitlines()) == 3
    assert main(["table", "run.mcap", good[0], "-o", "one.csv"]) == 0  # nothing of it is left out
    assert main(["query", "run.mcap", 'SELECT sum(data) AS s FROM "GOOD"'.replace("GOOD", good[1])]) == 0
    assert capsys.readouterr().out.startswith('"s"\n')
    assert main(["table", "run.mcap", wrong, "-o", "none.csv"]) == 1
    assert f"[{wrong}] is left out: the " in capsys.readouterr().err


def _definition(text: bytes) -> Callable[[dict[str, bytes]], None]:
    def change(header: dict[str, bytes]) -> None:
        header["type"], header["md5sum"], header["message_definition"] = b"own/Type", b"1" * 32, text

    return change


@pytest.mark.parametrize("text", [b"nothing x y", b""], ids=["broken", "empty"])
def test_a_definition_that_cannot_be_used_affects_only_its_topic(text: bytes, bad: int, capsys) -> None:
    good = write_bag(bad, _definition(text))
    wrong = names(bad)[0][bad]

    assert (main(["info", "run.bag"]), main(["check", "run.bag"])) == (0, 0)
    assert main(["filter", "run.bag", "same.bag", "t.to_sec() > 0"]) == 0
    with open_bag("same.bag") as reader:
        assert reader.message_count == 6  # copied as they are
    capsys.readouterr()
    for command in (["filter", "run.bag", "few.bag", "m.data > 0"], ["export", "run.bag", "out"]):
        assert main(command) == 1
        error = capsys.readouterr().err
        assert f"{wrong} " in error
        assert "definition of own/Type" in error
    with open_bag("few.bag") as reader:
        assert sorted({connection.topic for connection in reader.connections}) == good
        assert reader.message_count == 4
    assert sorted(os.listdir("out")) == [f"{topic[1:]}.csv" for topic in good]
    assert main(["table", "run.bag", *good, "-o", "both.csv"]) == 0
    assert main(["query", "run.bag", f"FROM {good[0][1:]}, {good[1][1:]}"]) == 0
    assert main(["table", "run.bag", wrong, "-o", "none.csv"]) == 1


def test_a_definition_that_cannot_be_used_affects_only_its_connection(bad: int) -> None:
    change = _definition(b"nothing x y")
    with open("run.bag", "w+b") as file:
        writer = BagWriter(file)
        for number in POSITIONS:
            header = header_of(Int32(), "/one")
            if number == bad:
                change(header)
            connection = writer.add_connection("/one", header)
            for time in (1, 2):
                writer.write(connection, time, number, struct.pack("<i", 10 * number + time))
        writer.finish()
    reported: list[tuple[str, str]] = []

    with open_bag("run.bag") as reader:
        with pytest.raises(BagError, match="own/Type"):
            next(reader.messages())
        reader.on_bad_message = lambda *words: reported.append(words)
        found = [each.message.data for each in reader.messages("/one")]
        assert [each.message.data for each in merged([reader])] == found

    good = [number for number in POSITIONS if number != bad]
    assert found == [10 * number + time for time in (1, 2) for number in good]
    assert len(reported) == 2
    assert all(topic == "/one" and "definition of own/Type" in reason for topic, reason in reported)


def test_a_time_that_ros_cannot_represent_affects_only_its_message(bad: int) -> None:
    with open("run.mcap", "wb") as file:
        writer = LibraryWriter(file, use_chunking=False)
        writer.start(profile="ros1", library="x")
        schema = writer.register_schema("std_msgs/Int32", "ros1msg", b"int32 data")
        channel = writer.register_channel("/one", "ros1", schema)
        for number in POSITIONS:
            time = 2**63 if number == bad else number + 1
            writer.add_message(channel, time, struct.pack("<i", number), time)
        writer.finish()
    reported: list[tuple[str, str]] = []

    with open_bag("run.mcap") as reader:
        with pytest.raises(
            BagError, match=r"/one: timestamps must be from 0 to 2\^32 s, got 9223372036854775808"
        ):
            list(reader.messages())
        reader.on_bad_message = lambda *words: reported.append(words)
        assert [each.message.data for each in reader.messages()] == [n for n in POSITIONS if n != bad]

    assert reported == [("/one", "timestamps must be from 0 to 2^32 s, got 9223372036854775808 ns")]


def test_a_message_that_a_rule_cannot_migrate_affects_only_itself(bad: int, capsys) -> None:
    made = message_classes_from_text("std_msgs/Int32", "int64 other")["std_msgs/Int32"]
    rows = [("/n", made(other=2**40 if number == bad else number), number + 1, 0) for number in POSITIONS]
    Path("old.bag").write_bytes(bag_bytes(rows))
    rule = rule_text(((made._type, made._md5sum), ("std_msgs/Int32", Int32._md5sum)), made, Int32)
    assign = "new_msg.data = old_msg.other"
    Path("rules.bmr").write_text(rule.replace("pass", assign).replace("valid = False", "valid = True"))

    assert main(["fix", "old.bag", "new.bag", "rules.bmr"]) == 1

    assert f"messages on /n are left out: the message received at {bad + 1}.0" in capsys.readouterr().err
    with open_bag("new.bag") as reader:
        assert [row[1] for row in rows_of(reader)] == [number for number in POSITIONS if number != bad]


def test_a_definition_that_cannot_be_migrated_does_not_stop_check_and_fix(bad: int, capsys) -> None:
    def change(header: dict[str, bytes]) -> None:
        header["md5sum"], header["message_definition"] = b"1" * 32, b"nothing x y"

    good = write_bag(bad, change)

    for command in (["check", "run.bag", "-g", "rules.bmr"], ["fix", "run.bag", "fixed.bag"]):
        assert main(command) == 1
        wrong = names(bad)[0][bad]
        assert f"WARNING: {wrong} is left out: the bag's definition" in capsys.readouterr().err
    with open_bag("fixed.bag") as reader:
        assert [row[0] for row in rows_of(reader, topics=good)] == good * 2


def test_a_damaged_message_affects_only_itself(bad: int, capsys: pytest.CaptureFixture[str]) -> None:
    good = write_bag(bad, lambda _: None, b"\1")
    wrong = names(bad)[0][bad]
    reason = f"messages on {wrong} are left out: the message received at 2.00000000{bad}: "

    commands = (
        ["export", "run.bag", "out"], ["filter", "run.bag", "few.bag", "m.data > 0"],
        ["table", "run.bag", wrong, "-o", "one.csv"], ["query", "run.bag", f"FROM {wrong[1:]}"],
        ["export", "--format", "npz", "run.bag", "out"],
    )  # fmt: skip
    for command in commands:
        assert main(command) == 1
        assert reason in capsys.readouterr().err
    sizes = {
        name: len(Path("out", name).read_text().splitlines()) for name in os.listdir("out") if "csv" in name
    }
    assert sizes == {f"{topic[1:]}.csv": 3 if topic in good else 2 for topic in names(bad)[0]}
    with open_bag("few.bag") as reader:
        assert reader.message_count == 5
    assert len(Path("one.csv").read_text().splitlines()) == 2
    assert main(["convert", "--ros2", "jazzy", "run.bag", "ros2"]) == 1
    assert f"messages on {wrong} are left out" in capsys.readouterr().err
    with open_bag("run.bag") as bag, open_any("ros2") as converted:
        assert (bag.message_count, converted.message_count) == (6, 5)


def open_any(path: str) -> Any:
    from pipros_rosbag2.bags.reader import open_any_bag

    return open_any_bag(path)


def test_an_illegal_name_affects_only_its_topic(bad: int, capsys: pytest.CaptureFixture[str]) -> None:
    illegal = ("/A b", "/b ../x", "/z\n")[bad]
    good = write_bag(bad, lambda _: None, wrong=illegal)

    assert main(["export", "run.bag", "out"]) == 1
    assert "is left out: it is not a legal topic name" in capsys.readouterr().err
    assert sorted(os.listdir("out")) == [f"{topic[1:]}.csv" for topic in good]
    assert main(["convert", "--ros2", "jazzy", "run.bag", "ros2"]) == 1
    with open_any("ros2") as converted:
        assert [connection.topic for connection in converted.connections] == good


def test_a_name_too_long_for_a_file_affects_only_its_topic(bad: int, capsys) -> None:
    good = write_bag(bad, lambda _: None, wrong=f"/{'abz'[bad]}{'n' * 300}")

    assert main(["export", "run.bag", "out"]) == 1
    assert "is left out: its name is too long for a file" in capsys.readouterr().err
    assert sorted(os.listdir("out")) == [f"{topic[1:]}.csv" for topic in good]


def test_messages_of_a_second_type_on_a_topic_are_left_out(bad: int, capsys) -> None:
    topics, good = names(bad)
    with open("run.bag", "w+b") as file:
        writer = BagWriter(file)
        for topic in topics:
            kinds: list[Any] = [Image(encoding="mono8", width=1, height=1, step=1, data=b"x"), Int32(7)]
            for kind in kinds if topic == topics[bad] else kinds[1:]:
                connection = writer.add_connection(topic, header_of(kind, topic))
                writer.write_message(connection, 1, 0, kind)
        writer.finish()

    assert main(["export", "run.bag", "out"]) == 1

    assert f"messages on {topics[bad]} are left out: their type is std_msgs/Int32" in capsys.readouterr().err
    written = [str(path.relative_to("out")) for path in Path("out").rglob("*.*")]
    image = f"{topics[bad][1:]}/1.000000000.png"
    assert sorted(written) == sorted([image, *(f"{topic[1:]}.csv" for topic in good)])


def test_a_wrong_md5_affects_nothing() -> None:
    write_bag(1, lambda header: header.update(md5sum=b"2" * 32, type=b"own/Int"))

    assert main(["export", "run.bag", "out"]) == 0
    assert sorted(os.listdir("out")) == ["a.csv", "c.csv", "e.csv"]


@pytest.mark.parametrize("content", [POINTER, b"", b"no bag"], ids=["pointer", "empty", "other"])
def test_a_file_that_is_not_a_bag_does_not_affect_the_others(content: bytes, bad: int, capsys) -> None:
    files = ["a.bag", "b.bag", "c.bag"]
    for number, name in enumerate(files):
        good = bag_bytes([("/n", Int32(number), 1 + number, 0)], compression="none")
        Path(name).write_bytes(content if number == bad else good)
    Path("out").mkdir()
    rest = [name for name in files if name != files[bad]]

    assert main(["info", *files]) == 1
    shown = capsys.readouterr()
    assert shown.out.count("messages:    1\n") == 2
    assert f"ERROR reading {files[bad]}: {files[bad]} is " in shown.err
    assert ("Git LFS" in shown.err) is (content == POINTER)
    assert main(["table", *files, "/n", "-o", "out.csv"]) == 1
    assert f"WARNING: {files[bad]} is left out: " in capsys.readouterr().err
    assert len(Path("out.csv").read_text().splitlines()) == 3
    assert main(["query", *files, "SELECT count(*) AS n FROM n"]) == 1
    assert capsys.readouterr().out == '"n"\n2\n'
    for command in ("compress", "decompress", "reindex", "convert"):
        assert main([command, "--output-dir", "out", *files]) == 1
        assert files[bad] in capsys.readouterr().err
        suffix = ".mcap" if command == "convert" else ".bag"
        assert sorted(path.stem for path in Path("out").glob(f"*{suffix}")) == [name[0] for name in rest]
        for path in Path("out").iterdir():
            path.unlink()


def depth(encoding: str, name: str, values: Any) -> Image:
    data = numpy.asarray(values, name)
    return Image(encoding=encoding, height=1, width=len(values), step=data.nbytes, data=data.tobytes())


ODD_IMAGES = {
    "empty": (Image(encoding="mono8"), "the image is empty"),
    "short": (Image(encoding="mono8", width=9, height=9, step=9, data=b"x"), "9 x 9 pixels of mono8 need"),
    "unknown": (Image(encoding="own", width=1, height=1, step=1, data=b"x"), "Unrecognized image encoding"),
    "no-jpeg": (CompressedImage(format="jpeg", data=b"GIF"), "begins like no known format"),
    "cut-jpeg": (CompressedImage(format="jpeg", data=b"\xff\xd8\xff\xe0cut"), "is cut: its end is missing"),
    "no-depth": (CompressedImage(format="16UC1; compressedDepth png", data=b"x"), "more than 12 bytes"),
    "rvl": (CompressedImage(format="16UC1; compressedDepth rvl", data=bytes(20)), "not RVL"),
}


@pytest.mark.parametrize("kind", ODD_IMAGES)
def test_an_image_that_cannot_be_written_affects_only_itself(kind: str, bad: int, capsys) -> None:
    wrong, reason = ODD_IMAGES[kind]
    good: Any = Image(encoding="mono8", width=1, height=1, step=1, data=b"x")
    if isinstance(wrong, CompressedImage):
        good = CompressedImage(format="jpeg", data=b"\xff\xd8\xff\xe0\xff\xd9")
    images = [wrong if number == bad else good for number in POSITIONS]
    rows: list[Any] = [("/b/camera", image, number, 0) for number, image in enumerate(images)]
    rows += [("/a/imu", Imu(), 1, 0), ("/c/imu", Imu(), 2, 0)]
    Path("run.bag").write_bytes(bag_bytes(rows))

    assert main(["export", "run.bag", "out"]) == 1

    error = capsys.readouterr().err
    assert f"messages on /b/camera are left out: the message received at {bad}.000000000: " in error
    assert reason in error
    stems = [path.stem for path in sorted(Path("out/b__camera").iterdir())]
    assert stems == [f"{number}.000000000" for number in POSITIONS if number != bad]
    assert Path("out/a__imu.csv").exists()
    assert Path("out/c__imu.csv").exists()


def write_ros2(
    bad: int, text: str = "int32 data", kind: str = "own/msg/Bad", encoding: str = "cdr"
) -> list[str]:
    """Write `run.db3` with three topics, one of a type with this definition. Return the good ones."""
    topics, good = names(bad)
    database = sqlite3.connect("run.db3")
    run = database.execute
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, "
        "offered_qos_profiles TEXT)")  # fmt: skip
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    run("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, "
        "encoded_message_definition TEXT, type_description_hash TEXT)")  # fmt: skip
    for number, topic in enumerate(topics):
        is_bad = number == bad
        values = (topic, kind if is_bad else f"own/msg/T{number}", encoding if is_bad else "cdr")
        run("INSERT INTO topics VALUES (?, ?, ?, ?, '')", (number, *values))
        definition = (values[1], text if is_bad else "int32 data")
        run("INSERT INTO message_definitions VALUES (NULL, ?, 'ros2msg', ?, '')", definition)
        for time in (1, 2):
            body = b"\0\1\0\0" + struct.pack("<i", 10 * number + time)
            run("INSERT INTO messages VALUES (NULL, ?, ?, ?)", (number, time * 10**9 + number, body))
    database.commit()
    database.close()
    return good


BAD_IN_ROS2 = {
    "broken": ({"text": "int64 a\n---\nint64 b"}, "its definition in the bag is invalid"),
    "no text": ({"text": "", "kind": "own/srv/Bad_Event"}, "is unknown in ROS 2"),
    "encoding": ({"encoding": "protobuf"}, "got the encoding [protobuf]"),
    "name": ({"kind": "Bad"}, "and the type [Bad]"),
    "wide": ({"text": "wstring data"}, "ROS 1 has no wide strings"),
    "embeds": ({"text": "other/Unknown data"}, "other/msg/Unknown is unknown"),
}


@pytest.mark.parametrize("case", BAD_IN_ROS2)
def test_a_topic_of_ros2_that_cannot_be_read_affects_only_itself(case: str, bad: int, capsys) -> None:
    options, reason = BAD_IN_ROS2[case]
    good = write_ros2(bad, **options)
    wrong = names(bad)[0][bad]

    assert main(["info", "run.db3"]) == 0
    shown = capsys.readouterr()
    assert f" {wrong}: " in shown.out
    assert reason in shown.out
    assert main(["info", "-y", "-k", "left_out[0].name", "run.db3"]) == 0
    assert capsys.readouterr().out == f"{wrong}\n"
    for command in (["convert", "run.db3", "out.bag"], ["filter", "run.db3", "few.bag", "m.data > 0"]):
        assert main(command) == 1
        assert f"WARNING: {wrong} is left out: " in capsys.readouterr().err
        with open_bag(command[2]) as reader:
            assert [row[:2] for row in rows_of(reader)] == [
                (topic, 10 * names(bad)[0].index(topic) + time) for time in (1, 2) for topic in good
            ]
    assert main(["export", "run.db3", "out"]) == 1
    assert sorted(os.listdir("out")) == [f"{topic[1:]}.csv" for topic in good]
    assert (main(["check", "run.db3"]), main(["table", "run.db3", *good, "-o", "both.csv"])) == (1, 0)


def test_a_damaged_message_of_ros2_affects_only_itself(bad: int, capsys: pytest.CaptureFixture[str]) -> None:
    write_ros2(bad)
    wrong = names(bad)[0][bad]
    database = sqlite3.connect("run.db3")
    database.execute(
        "UPDATE messages SET data = x'00010000' WHERE topic_id = ? AND timestamp > 1999999999", (bad,)
    )
    database.commit()
    database.close()

    for command in (
        ["convert", "run.db3", "out.bag"],
        ["export", "run.db3", "out"],
        ["table", "run.db3", wrong, "-o", "one.csv"],
    ):
        assert main(command) == 1
        reason = f"messages on {wrong} are left out: the message received at 2.00000000{bad}: "
        assert reason in capsys.readouterr().err
    with open_bag("out.bag") as reader:
        assert reader.message_count == 5
    assert len(Path("one.csv").read_text().splitlines()) == 2


@pytest.mark.parametrize("value", [None, "text", 5])
def test_a_row_of_ros2_with_a_wrong_value_affects_only_itself(value: object, bad: int, capsys) -> None:
    write_ros2(bad)
    with closing(sqlite3.connect("run.db3")) as database:
        database.execute(
            "UPDATE messages SET data = ? WHERE topic_id = ? AND timestamp > 1999999999", (value, bad)
        )
        database.commit()

    assert main(["convert", "run.db3", "out.bag"]) == 1

    assert f"messages on {names(bad)[0][bad]} are left out: " in capsys.readouterr().err
    with open_bag("out.bag") as reader:
        assert reader.message_count == 5


def test_each_bag_names_what_it_leaves_out(capsys: pytest.CaptureFixture[str]) -> None:
    for number, kind in enumerate((b"nothing x y", b"other z")):
        write_mcap(1, "ros1", ("ros1msg", kind))
        os.rename("run.mcap", f"{number}.mcap")

    assert main(["table", "0.mcap", "1.mcap", "/a", "-o", "a.csv"]) == 0

    lines = capsys.readouterr().err.splitlines()
    assert [line.split(":")[1] for line in lines] == [" /c is left out", " /c of 1.mcap is left out"]


@pytest.mark.parametrize("has_metadata", [True, False])
def test_a_bad_file_of_a_ros2_bag_affects_only_itself(has_metadata: bool, bad: int, capsys) -> None:
    Path("run").mkdir()
    files = [f"run_{number}.db3" for number in POSITIONS]
    write_ros2(0)
    for number, name in enumerate(files):
        Path("run", name).write_bytes(POINTER if number == bad else Path("run.db3").read_bytes())
    if has_metadata:
        text = "rosbag2_bagfile_information: {version: 9, storage_identifier: sqlite3, relative_file_paths: "
        text += f"[{', '.join(files)}], topics_with_message_count: [], starting_time: "
        text += "{nanoseconds_since_epoch: 0}, duration: {nanoseconds: 0}, message_count: 0}"
        Path("run/metadata.yaml").write_text(text)

    assert main(["info", "run"]) == 1
    shown = capsys.readouterr()
    assert "messages:    12\n" in shown.out
    assert f"run/{files[bad]} is not a bag, but a pointer of Git LFS" in shown.out
    assert main(["convert", "run", "out.bag"]) == 1
    assert f"WARNING: run/{files[bad]} is left out: " in capsys.readouterr().err


def test_a_damaged_chunk_of_an_mcap_file_affects_only_itself(bad: int, capsys) -> None:
    file = io.BytesIO()
    writer = LibraryWriter(file, chunk_size=1)
    writer.start(profile="ros2", library="x")
    channel = writer.register_channel("/a", "json", writer.register_schema("own", "jsonschema", b"{}"))
    for time in (1, 2, 3):
        writer.add_message(channel, time, b"message %d" % time, time)
    writer.finish()
    content = file.getvalue().replace(b"message %d" % (bad + 1), b"message x")  # its checksum is wrong now
    if b"message" not in file.getvalue():
        pytest.fail("the messages must be stored uncompressed")
    Path("run.mcap").write_bytes(content)

    assert main(["reindex", "run.mcap"]) == 0

    assert "checksum is wrong" in capsys.readouterr().err
    from mcap.reader import make_reader

    with open("run.mcap", "rb") as fixed:
        reader = make_reader(fixed)
        found = [(c.topic, c.message_encoding, s.encoding, m.data) for s, c, m in reader.iter_messages()]
        assert reader.get_header().profile == "ros2"
    expected = [b"message %d" % time for time in (1, 2, 3) if time != bad + 1]
    assert found == [("/a", "json", "jsonschema", data) for data in expected]


def test_topics_that_differ_only_in_case_have_separate_tables(capsys: pytest.CaptureFixture[str]) -> None:
    rows: list[Any] = [("/a_b", Int32(1), 1, 0), ("/A_B", Int32(2), 1, 0), ("/c", String("x"), 1, 0)]
    Path("run.bag").write_bytes(bag_bytes(rows))

    for sql, expected in {
        'SELECT data FROM "/a_b"': "1", 'SELECT data FROM "/A_B"': "2", "SELECT data FROM a_b": "1",
        "SELECT data FROM A_B": "2", "SELECT data FROM C": '"x"',
        """SELECT "/A_B".data - "/a_b".data || '"/a_b"' AS data FROM "/A_B", "/a_b" """: '"1""/a_b"""',
    }.items():  # fmt: skip
        assert (main(["query", "run.bag", sql]), capsys.readouterr().out) == (0, f'"data"\n{expected}\n')
    assert main(["query", "run.bag", 'SELECT * FROM "/a_B"']) == 1
    assert "/A_B, /a_b, /c" in capsys.readouterr().err


def write_chunks(path: str, bad: int) -> list[int]:
    """Write a bag or an MCAP file with three chunks, of which one is damaged. Return the others' values."""
    if path.endswith(".mcap"):
        with open(path, "wb") as file:
            writer = LibraryWriter(file, chunk_size=1900, compression=CompressionType.NONE)
            writer.start(profile="ros1", library="x")
            schema = writer.register_schema("std_msgs/Int32", "ros1msg", b"int32 data")
            channels = [writer.register_channel(topic, "ros1", schema) for topic in ("/a", "/c")]
            for n in range(120):
                writer.add_message(channels[n % 2], (1 + n) * 10**9, struct.pack("<i", n), 0)
            writer.finish()
        with open(path, "rb") as file:
            indexes = make_reader(file).get_summary().chunk_indexes
        places = [each.chunk_start_offset + each.chunk_length // 2 for each in indexes]
    else:
        rows = [(f"/{'ac'[n % 2]}", Int32(n), 1 + n, 0) for n in range(120)]
        Path(path).write_bytes(bag_bytes(rows, compression="bz2", chunk_bytes=2500))
        with open_bag(path) as bag:
            headers = [bag.chunk_header(number) for number in range(len(bag.chunks))]
        places = [header.data_position + header.data_size // 2 for header in headers]
    assert len(places) == 3
    with open_bag(path) as bag:
        starts = [getattr(each, "start_ns", None) or each.message_start_time for each in bag.chunks]
        found = [(bag.decode(each).data, bisect(starts, each.time_ns) - 1) for each in bag.stored_messages()]
    data = bytearray(Path(path).read_bytes())
    data[places[bad]] ^= 0xFF
    Path(path).write_bytes(data)
    return [value for value, chunk in found if chunk != bad]


@pytest.mark.parametrize("path", ["run.bag", "run.mcap"])
def test_only_the_messages_of_a_damaged_chunk_are_left_out(path: str, bad: int, capsys) -> None:
    good = write_chunks(path, bad)
    assert 40 <= len(good) < 120

    for command in (["filter", path, "out.bag", "True"], ["convert", "-q", path, "copy.bag"]):
        assert main(command) == 1
        shown = capsys.readouterr().err
        for topic in ("/a", "/c"):
            assert f"messages on {topic} are left out: {path}, byte " in shown
        with open_bag(next(name for name in command[2:] if name.endswith(".bag") and name != path)) as bag:
            assert [message.data for _, message, _, _ in bag.messages()] == good

    assert (main(["export", path, "out"]), main(["table", path, "/a", "-q", "-o", "a.csv"])) == (1, 1)
    of_a = [str(value) for value in good if value % 2 == 0]
    assert [line.split(",")[-1] for line in Path("a.csv").read_text().splitlines()[1:]] == of_a
    assert len(Path("out/c.csv").read_text().splitlines()) == 1 + sum(value % 2 for value in good)


def test_a_damaged_chunk_is_an_error_with_advice_for_programs() -> None:
    write_chunks("run.bag", 1)
    with open_bag("run.bag") as bag, pytest.raises(BagFormatError, match=r"chunk: .* Try rosbag reindex"):
        list(bag.messages())


def test_a_chunk_without_its_index_is_left_out_until_the_bag_is_reindexed(capsys) -> None:
    rows = [("/a", Int32(n), 1 + n, 0) for n in range(120)]
    data = bag_bytes(rows, chunk_bytes=2500)
    Path("run.bag").write_bytes(data.replace(b"op=\x04", b"op=\x09", 1))

    assert main(["filter", "run.bag", "out.bag", "True"]) == 1
    assert "the record must be an index, got op 9. Try rosbag reindex" in capsys.readouterr().err
    with open_bag("out.bag") as bag:
        assert 40 <= len(list(bag.messages())) < 120
    assert main(["reindex", "-q", "run.bag"]) == 0
    with open_bag("run.bag") as bag:
        assert [message.data for _, message, _, _ in bag.messages()] == list(range(120))


UNUSABLE = {
    "no type": lambda header: header.pop("type"),
    "empty type": lambda header: header.update(type=b""),
    "no fields": lambda header: header.clear(),
}


@pytest.mark.parametrize("change", UNUSABLE.values(), ids=UNUSABLE)
def test_only_a_connection_without_a_type_is_left_out(bad: int, change: Change, capsys) -> None:
    good = write_bag(bad, change)
    lost = f"/{'ace'[bad]}"

    assert main(["info", "run.bag"]) == 0
    assert f"left out:    {lost}: run.bag, byte " in capsys.readouterr().out
    assert main(["filter", "run.bag", "out.bag", "True"]) == 1
    assert f"{lost} is left out: run.bag, byte " in capsys.readouterr().err
    assert main(["table", "run.bag", good[0], "-q", "-o", "good.csv"]) == 0
    with open_bag("out.bag") as bag:
        assert sorted({topic for topic, *_ in bag.messages()}) == good

    with rosbag.Bag("run.bag", "a") as added:  # the number of the lost connection is not used again
        added.write("/new", Int32(7), rospy.Time(9))
    with open_bag("run.bag") as bag:
        assert [message.data for topic, message, _, _ in bag.messages() if topic == "/new"] == [7]

    assert main(["reindex", "-q", "-f", "run.bag"]) == 0
    assert f"{lost} is left out: " in capsys.readouterr().err
    with open_bag("run.bag") as bag:
        assert sorted({topic for topic, *_ in bag.messages()}) == sorted([*good, "/new"])
