"""ROS 2 bags: written ones are read by rosbags, and those of rosbags are read like ROS 1 bags."""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg

from pipros.msg import load_message_class
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.digest import SEPARATOR
from pipros.msg.time import Time
from pipros_rosbag2.bags.metadata import parse_metadata
from pipros_rosbag2.bags.reader import Ros2BagReader
from pipros_rosbag2.distribution import Distribution
from pipros_tools.bag.errors import BagError, BagFormatError
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.topic_writer import TopicWriter
from pipros_tools.bag.writer import BagWriter
from pipros_tools.cli.rosbag import main as rosbag
from tests.support.full_disk import files_limited_to
from tests.support.ros2_samples import store_of

MINE = f"Header header\nint8[] x\n{SEPARATOR}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id"

LATCHED = Qos(
    QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, QosTime(0, 0),
    QosTime(0, 0), QosLiveliness.AUTOMATIC, QosTime(0, 0), False,
)  # fmt: skip


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


@contextmanager
def writing(path: str = "run.bag") -> Iterator[TopicWriter]:
    with Path(path).open("w+b") as file:
        bag = BagWriter(file)
        yield TopicWriter(bag)
        bag.finish()


def write_ros1(path: str = "run.bag") -> None:
    """Write a bag with strings, a latched map, a type of the user, and a type that ROS 2 lacks."""
    text: Any = load_message_class("std_msgs/String")
    grid: Any = load_message_class("nav_msgs/OccupancyGrid")
    header: Any = load_message_class("rosgraph_msgs/TopicStatistics")
    mine: Any = message_classes_from_text("my_pkg/Mine", MINE)["my_pkg/Mine"]
    with writing(path) as writer:
        latched = {"latching": "1", "callerid": "/map_server"}
        map_message = grid(data=[1, -1])
        map_message.header.stamp = Time(5, 6)
        writer.write("/map", map_message, 9, 1, latched)
        for number in range(5):
            writer.write("/chatter", text(data=f"hello {number}"), 10 + number, 5)
        writer.write("/mine", mine(x=[3]), 20, 0)
        writer.write("/statistics", header(), 21, 0)


@pytest.mark.parametrize("distribution", Distribution)
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_rosbags_reads_converted_bags(
    distribution: Distribution, storage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    write_ros1()

    code = rosbag(["convert", "--ros2", distribution.value, "--storage", storage, "run.bag", "out"])

    assert code == 1
    assert "WARNING: /statistics is left out: no type in ROS 2" in capsys.readouterr().err
    store = store_of(distribution)
    with Reader("out") as reader:
        found = [(c.topic, c.msgtype, time, bytes(data)) for c, time, data in reader.messages()]
        qos = {c.topic: [each.durability for each in c.ext.offered_qos_profiles] for c in reader.connections}
        hashes = {c.topic: c.digest for c in reader.connections}
        assert reader.duration == 20 * 10**9 - 9 * 10**9 - 1 + 1
    texts = [store.deserialize_cdr(data, kind).data for topic, kind, _, data in found if topic == "/chatter"]
    assert texts == [f"hello {number}" for number in range(5)]
    assert [topic for topic, *_ in found] == ["/map", *["/chatter"] * 5, "/mine"]
    assert [time for _, _, time, _ in found][:2] == [9_000_000_001, 10_000_000_005]
    grid = store.deserialize_cdr(found[0][3], "nav_msgs/msg/OccupancyGrid")
    assert (grid.header.stamp.sec, list(grid.data)) == (5, [1, -1])
    assert qos == {"/map": [QosDurability.TRANSIENT_LOCAL], "/chatter": [], "/mine": []}
    if distribution.has_type_hashes:
        assert hashes["/chatter"].startswith("RIHS01_df668c74")


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_metadata_have_the_version_of_the_distribution(storage: str) -> None:
    write_ros1()
    for distribution in Distribution:
        folder = f"out_{distribution.value}"
        rosbag(["convert", "--ros2", distribution.value, "--storage", storage, "run.bag", folder])
        values = yaml.safe_load(Path(folder, "metadata.yaml").read_text())["rosbag2_bagfile_information"]
        profiles = values["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"]
        is_humble = distribution is Distribution.HUMBLE

        assert values["version"] == (5 if is_humble else 9)
        assert ("ros_distro" in values) is not is_humble
        # Humble reads text with numbers, the others read words.
        parsed = yaml.safe_load(profiles) if is_humble else profiles
        assert isinstance(profiles, str) is is_humble
        assert parsed[0]["durability"] == (1 if is_humble else "transient_local")
        suffix = "mcap" if storage == "mcap" else "db3"
        assert values["relative_file_paths"] == [f"{folder}_0.{suffix}"]
        assert Path(folder, f"{folder}_0.{suffix}").is_file()


def test_humble_gets_sqlite_and_others_mcap() -> None:
    write_ros1()

    for distribution in ("humble", "jazzy"):
        assert rosbag(["convert", "--ros2", distribution, "--output-dir", distribution, "run.bag"]) == 1

    assert sorted(os.listdir("humble/run")) == ["metadata.yaml", "run_0.db3"]
    assert sorted(os.listdir("jazzy/run")) == ["metadata.yaml", "run_0.mcap"]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_converted_bag_converts_back(storage: str, capsys: pytest.CaptureFixture[str]) -> None:
    write_ros1()
    rosbag(["convert", "--ros2", "jazzy", "--storage", storage, "run.bag", "out"])

    assert rosbag(["convert", "out", "again.bag"]) == 0

    with BagReader("run.bag") as bag, BagReader("again.bag") as again:
        before = [(m.topic, m.message, m.time) for m in bag.messages() if m.topic != "/statistics"]
        after = [(m.topic, m.message, m.time) for m in again.messages()]
        assert [str(each) for each in after] == [str(each) for each in before]
        latched = {connection.topic: connection.is_latching for connection in again.connections}
        assert latched == {"/map": True, "/chatter": False, "/mine": False}


def write_ros2(storage: StoragePlugin, *, version: Any = 9, folder: str = "ros2") -> None:
    store = store_of(Distribution.JAZZY)
    types = get_types_from_msg(
        "float64 a\nOther[<=2] b\nbuiltin_interfaces/Time t", "robot_interfaces/msg/State"
    )
    types |= get_types_from_msg("string<=5 s", "robot_interfaces/msg/Other")
    if "robot_interfaces/msg/State" not in store.fielddefs:
        store.register(types)
    state, other = (store.types[f"robot_interfaces/msg/{name}"] for name in ("State", "Other"))
    time = store.types["builtin_interfaces/msg/Time"]
    with Writer(folder, version=version, storage_plugin=storage) as writer:
        connection = writer.add_connection("/state", state.__msgtype__, typestore=store)
        message = state(0.5, [other("hi")], time(3, 4))
        writer.write(connection, 5, store.serialize_cdr(message, state.__msgtype__))
        kind = "sensor_msgs/msg/Range"
        ranges = writer.add_connection("/range", kind, typestore=store, offered_qos_profiles=[LATCHED])
        header = store.types["std_msgs/msg/Header"](time(1, 2), "laser")
        message = store.types[kind](header, 1, 0.5, 0.25, 4.0, 2.5, 0.125)
        writer.write(ranges, 7, store.serialize_cdr(message, kind))
        writer.add_connection("/split", "rosbag2_interfaces/msg/ReadSplitEvent", typestore=store)


def sqlite_bag(*statements: str) -> Path:
    """Write a bag of ROS 2, and change its database."""
    write_ros2(StoragePlugin.SQLITE3)
    (file,) = Path("ros2").glob("*.db3")
    with closing(sqlite3.connect(file)) as database:
        for statement in statements:
            database.execute(statement)
        database.commit()
    return file


@pytest.mark.parametrize(
    ("storage", "version"), [(StoragePlugin.MCAP, 9), (StoragePlugin.SQLITE3, 9), (StoragePlugin.SQLITE3, 8)]
)
def test_bags_of_rosbags_are_read(storage: StoragePlugin, version: int) -> None:
    write_ros2(storage, version=version)

    with Ros2BagReader(Path("ros2")) as bag:
        found = {topic: message for topic, message, _, _ in bag.messages()}
        assert (bag.skipped, bag.range_ns) == ({}, (5, 7))
        assert bag.times_ns() == {0: [5], 1: [7], 2: []} or bag.times_ns() == {0: [5], 1: [7]}
        assert [c.is_latching for c in bag.connections_of("/range")] == [True]
        assert bag.topic_types["/state"] == "robot_interfaces/msg/State"
        assert [m.topic for m in bag.messages(start=6e-9)] == ["/range"]
    state = found["/state"]
    assert (state._type, state.a, state.b[0].s, state.t) == ("robot_interfaces/State", 0.5, "hi", Time(3, 4))
    assert (found["/range"].range, found["/range"].header.frame_id) == (2.5, "laser")
    assert isinstance(found["/range"], load_message_class("sensor_msgs/Range"))


@pytest.mark.parametrize("storage", StoragePlugin)
def test_info_export_and_single_files(storage: StoragePlugin, capsys: pytest.CaptureFixture[str]) -> None:
    write_ros2(storage)
    file = next(path for path in Path("ros2").iterdir() if path.suffix != ".yaml")

    for path in ("ros2", str(file)):
        assert rosbag(["info", path]) == 0
        shown = capsys.readouterr().out
        assert "version:     ROS 2 jazzy" in shown
        assert "messages:    2" in shown
        assert "robot_interfaces/State" in shown
        assert rosbag(["info", "--freq", "-y", path]) == 0
        capsys.readouterr()
        assert rosbag(["export", path, "tables", "/range"]) == 0
        assert Path("tables/range.csv").read_text().splitlines()[1].endswith(",1,0.5,0.25,4.0,2.5")


def test_what_does_not_fit_is_left_out_with_a_reason(capsys: pytest.CaptureFixture[str]) -> None:
    solid: Any = load_message_class("shape_msgs/SolidPrimitive")
    text: Any = load_message_class("std_msgs/String")
    number: Any = load_message_class("std_msgs/Int8")
    with writing() as writer:
        for count in (3, 4):
            writer.write("/solid", solid(dimensions=[1.0] * count), count, 0)
        writer.write("/9", number(), 5, 0)
        writer.write("/two", text(data="a"), 6, 0)
        writer.write("/two", number(), 7, 0)
        writer.write_raw("/broken", "a/B", "1" * 32, b"", 8, 0, {"message_definition": "nothing x y"})

    assert rosbag(["convert", "--ros2", "jazzy", "run.bag", "out"]) == 1

    error = capsys.readouterr().err
    assert "messages on /solid are left out: shape_msgs/SolidPrimitive: a field has a length of 4" in error
    assert "/9 is left out: [/9] is not a full ROS 2 name" in error
    assert (
        "messages on /two are left out: a topic can have only one type in ROS 2: std_msgs/msg/String, not"
        in error
    )
    assert "/broken is left out: " in error
    with Reader("out") as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == {"/solid": 1, "/two": 1}


def test_messages_with_another_definition_of_their_type_are_left_out(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """They lost their further fields in silence."""
    with Path("run.bag").open("w+b") as file:
        bag = BagWriter(file)
        for topic, text in (("/a", "int32 x"), ("/a", "int32 x\nint32 y"), ("/b", "int32 x\nint32 y")):
            kind = message_classes_from_text("my_msgs/Battery", text)["my_msgs/Battery"]
            TopicWriter(bag).write(topic, kind(x=1), 1, 0)
        bag.finish()
    assert rosbag(["convert", "--ros2", "jazzy", "run.bag", "new"]) == 1
    printed = capsys.readouterr().err
    assert "messages on /a are left out: this definition of my_msgs/msg/Battery differs" in printed
    assert "/b is left out: this definition of my_msgs/msg/Battery differs" in printed
    with Ros2BagReader(Path("new")) as again:
        assert [topic for topic, *_ in again.messages()] == ["/a"]


def test_a_bag_without_messages() -> None:
    with writing("empty.bag"):
        pass
    for storage in ("mcap", "sqlite3"):
        assert rosbag(["convert", "--ros2", "jazzy", "--storage", storage, "empty.bag", storage]) == 0
        with Reader(storage) as reader:
            assert reader.message_count == 0
        assert rosbag(["info", storage]) == 0


def test_definitions_and_rules_of_the_user(capsys: pytest.CaptureFixture[str]) -> None:
    write_ros1()
    folder = Path("share/my_interfaces/msg")
    folder.mkdir(parents=True)
    (folder / "Yours.msg").write_text("std_msgs/Header header\nint8[] y\nfloat64 z 0.5")
    Path("rules.yaml").write_text(
        "- {ros1_package_name: my_pkg, ros1_message_name: Mine, ros2_package_name: my_interfaces, "
        "ros2_message_name: Yours, fields_1_to_2: {header: header, x: 'y'}}"
    )

    code = rosbag(
        ["convert", "--ros2", "jazzy", "--rules", "rules.yaml", "--msgs", "share", "run.bag", "out"]
    )

    assert code == 1  # /statistics is left out
    with Reader("out") as reader:
        (connection,) = [each for each in reader.connections if each.topic == "/mine"]
        assert connection.msgtype == "my_interfaces/msg/Yours"
        assert "float64 z 0.5" in connection.msgdef.data
        ((_, _, data),) = reader.messages([connection])
        assert np.frombuffer(data[-8:], "<f8").tolist() == [0.5]


@pytest.mark.parametrize(("arguments", "reason"), [
    (["--ros2", "foxy", "run.bag", "out"], "must be one of humble, jazzy, kilted, lyrical, got [foxy]"),
    (["--ros2", "jazzy", "--storage", "x", "run.bag", "out"], "must be one of mcap, sqlite3, got [x]"),
    (["--ros2", "jazzy", "--compression", "x", "run.bag", "out"], "compression must be one of"),
    (["--ros2", "jazzy", "run.bag", "there"], "there already exists"),
    (["--ros2", "jazzy", "--rules", "bad.yaml", "run.bag", "out"], "bad.yaml, rule 1"),
    (["--ros2", "jazzy", "missing.bag", "out"], "missing.bag"),
])  # fmt: skip
def test_invalid_conversions_leave_nothing(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    write_ros1()
    Path("there").mkdir()
    Path("bad.yaml").write_text("- 5")
    before = sorted(os.listdir())

    assert rosbag(["convert", *arguments]) == 1

    assert reason in capsys.readouterr().err
    assert sorted(os.listdir()) == before


@pytest.mark.needs("resource limits")
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_full_disk_is_an_error_and_leaves_nothing(storage: str, capsys: pytest.CaptureFixture[str]) -> None:
    text: Any = load_message_class("std_msgs/String")
    with writing() as writer:
        for number in range(100):
            writer.write("/chatter", text(data=os.urandom(5_000).hex()), number, 0)

    with files_limited_to(100_000):
        code = rosbag(["convert", "--ros2", "jazzy", "--storage", storage, "run.bag", "out"])

    assert code == 1
    error = capsys.readouterr().err
    assert error.startswith("ERROR converting run.bag: ")
    assert "cannot write out" in error or error.endswith(": 'out'\n")
    assert os.listdir() == ["run.bag"]


def test_damaged_bags_raise() -> None:
    file = sqlite_bag()
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(BagError):
        list(Ros2BagReader(file).messages())
    text = Path("ros2/metadata.yaml").read_text()
    for old, new in (("relative_file_paths", "x"), ("version: 9", "version: []"), ("duration:", "a: ]")):
        with pytest.raises(BagFormatError):
            parse_metadata(text.replace(old, new), "metadata.yaml")


@pytest.mark.parametrize(
    "messages",
    [
        "CREATE VIEW messages AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) "
        "SELECT x AS id, 1 AS topic_id, x AS timestamp, x AS data FROM c",
        "CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data AS (zeroblob(9)))",
        "CREATE TABLE other(x)",
    ],
)
def test_a_file_cannot_make_reading_endless(messages: str) -> None:
    with closing(sqlite3.connect("evil.db3")) as database:
        database.execute("CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT)")
        database.execute(messages)
        database.commit()

    with pytest.raises(BagFormatError, match="a table is missing, is a view"):
        Ros2BagReader(Path("evil.db3"))


def test_a_damaged_message_names_its_topic() -> None:
    sqlite_bag("UPDATE messages SET data = x'0001000005' WHERE topic_id = 1")

    with (
        Ros2BagReader(Path("ros2")) as bag,
        pytest.raises(BagFormatError, match="a message on /state is damaged"),
    ):
        list(bag.messages())


def test_topics_with_unknown_types_are_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    sqlite_bag("DELETE FROM message_definitions")

    assert rosbag(["info", "ros2"]) == 0

    error = capsys.readouterr().err
    assert (
        "WARNING: /state is left out: the type robot_interfaces/msg/State is unknown in ROS 2 jazzy" in error
    )
    assert "--msgs" in error


def test_compressed_bags_are_refused() -> None:
    write_ros2(StoragePlugin.MCAP)
    file = Path("ros2/metadata.yaml")
    text = file.read_text().replace("compression_format: ''", "compression_format: zstd")
    file.write_text(text.replace('compression_format: ""', "compression_format: zstd"))

    with pytest.raises(BagError, match="compressed with zstd"):
        Ros2BagReader(Path("ros2"))


def test_a_folder_of_ros1_bags_names_the_pattern_for_them() -> None:
    Path("runs").mkdir()
    Path("runs/run.bag").touch()

    with pytest.raises(BagError, match=r"without \.mcap or \.db3 files; name its bags: runs/\*\.bag$"):
        Ros2BagReader(Path("runs"))


def leave_log(database: Path, mode: str, log: Path) -> None:
    """Leave a database and its log as if the recorder had been killed."""
    with closing(sqlite3.connect(database, isolation_level=None)) as changed:
        changed.execute(f"PRAGMA journal_mode = {mode}")
        changed.execute("PRAGMA cache_size = 1")
        rows = changed.execute("SELECT * FROM messages").fetchall()
        if mode == "WAL":
            changed.execute("DELETE FROM messages")
            changed.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            changed.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        else:
            changed.execute("BEGIN")
            changed.execute("DELETE FROM messages")
            changed.executemany("INSERT INTO messages VALUES (NULL, 1, 1, ?)", [[bytes(4000)]] * 50)
        content, left = database.read_bytes(), log.read_bytes()
    database.write_bytes(content)
    log.write_bytes(left)


@pytest.mark.parametrize("mode", ["WAL", "DELETE", "PERSIST"])
def test_messages_in_the_log_of_a_killed_recorder_are_read_and_recovered(
    mode: str, capsys: pytest.CaptureFixture[str]
) -> None:
    kind = "wal" if mode == "WAL" else "journal"
    write_ros1()
    rosbag(["convert", "--ros2", "jazzy", "--storage", "sqlite3", "run.bag", "out"])
    database, log = Path("out/out_0.db3"), Path(f"out/out_0.db3-{kind}")
    leave_log(database, mode, log)
    before = database.read_bytes(), log.read_bytes()

    with Ros2BagReader(database) as bag:
        assert bag.message_count == 7
        assert len(list(bag.messages("/chatter"))) == 5
    assert sorted(each.name for each in Path("out").iterdir()) == [
        "metadata.yaml", "out_0.db3", log.name,
    ]  # fmt: skip
    assert (database.read_bytes(), log.read_bytes()) == before

    assert rosbag(["reindex", str(database)]) == 0

    assert not log.exists()
    assert Path(f"out/out_0.orig.db3-{kind}").read_bytes() == before[1]
    with Ros2BagReader(database) as bag:
        assert bag.message_count == 7
    with closing(sqlite3.connect(database)) as whole:
        assert whole.execute("SELECT count(*) FROM messages").fetchone() == (7,)


def test_topics_that_would_have_one_name_are_not_mixed(capsys: pytest.CaptureFixture[str]) -> None:
    number: Any = load_message_class("std_msgs/Int32")
    with Path("run.bag").open("w+b") as file:
        bag = BagWriter(file)
        for at, topic in enumerate(("pose", "/pose", "pose", "/pose")):
            TopicWriter(bag).write(topic, number(at), 10 + at, 0)
        bag.finish()

    assert rosbag(["convert", "--ros2", "jazzy", "run.bag", "out"]) == 1

    assert (
        "/pose is left out: in ROS 2, it would have the same name, /pose, as [pose]"
        in capsys.readouterr().err
    )
    with Ros2BagReader(Path("out")) as found:
        assert [each.message.data for each in found] == [0, 2]


def test_force_replaces_a_bag_and_what_an_interrupted_conversion_left(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_ros1()
    Path("out.active").mkdir()
    Path("out.active/out_0.mcap").write_bytes(b"part")
    command = ["convert", "--ros2", "jazzy", "run.bag", "out"]
    assert rosbag(command) == 1
    assert "out.active already exists; --force replaces what an earlier" in capsys.readouterr().err

    for more in ([], ["--storage", "sqlite3"]):
        rosbag([*command, "-f", *more])
        with Ros2BagReader(Path("out")) as bag:
            assert bag.message_count == 7
    assert sorted(each.name for each in Path("out").iterdir()) == ["metadata.yaml", "out_0.db3"]
    assert sorted(each.name for each in Path().iterdir()) == ["out", "run.bag"]

    assert rosbag(command) == 1
    assert "out already exists; --force replaces it" in capsys.readouterr().err
    assert rosbag(["convert", "-f", "--ros2", "jazzy", "out", "out"]) == 1
    assert rosbag(["convert", "-f", "--ros2", "jazzy", "out/out_0.db3", "out"]) == 1
    assert capsys.readouterr().err.count("out is the input") == 2
    Path("there").mkdir()
    os.chdir("there")
    assert rosbag(["convert", "-f", "--ros2", "jazzy", "../run.bag", ""]) == 1
    assert "a bag must have a name of its own, got [.]" in capsys.readouterr().err


def test_force_does_not_remove_other_files(capsys: pytest.CaptureFixture[str]) -> None:
    write_ros1()
    for name in ("folder/notes.txt", "file"):
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text("mine")
        assert rosbag(["convert", "-f", "--ros2", "jazzy", "run.bag", name.partition("/")[0]]) == 1
        assert "is not replaced, because it is not only a ROS 2 bag" in capsys.readouterr().err
        assert Path(name).read_text() == "mine"


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_the_files_of_a_folder_are_reindexed(storage: str) -> None:
    write_ros1()
    rosbag(["convert", "--ros2", "jazzy", "--storage", storage, "run.bag", "out"])

    assert rosbag(["reindex", "-q", "out"]) == 0

    assert len([each for each in Path("out").iterdir() if ".orig." in each.name]) == 1
    with Ros2BagReader(Path("out")) as bag:
        assert bag.message_count == 7


@pytest.mark.parametrize("suffix", ["zstd", "gz", "xz"])
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_compressed_file_in_a_folder_is_named(
    storage: str, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    write_ros1()
    rosbag(["convert", "--ros2", "jazzy", "--storage", storage, "run.bag", "out"])
    (file,) = Path("out").glob("out_0.*")
    file.rename(f"{file}.{suffix}")

    assert rosbag(["info", "out"]) == 1

    assert f"{file.name}.{suffix} is compressed with {suffix}; decompress it first" in capsys.readouterr().err


def test_topics_share_the_definition_of_their_type_and_those_without_names_are_counted() -> None:
    file = sqlite_bag()
    with closing(sqlite3.connect(file)) as database:
        columns = "type, serialization_format, offered_qos_profiles, type_description_hash"
        query = f"INSERT INTO topics (name, {columns}) SELECT ?, {columns} FROM topics WHERE id = 1"  # noqa: S608
        database.executemany(query, [(f"/more{number}",) for number in range(3)])
        rows = [(number, 5) for number in range(1000, 1030)]
        database.executemany("INSERT INTO messages VALUES (NULL, ?, ?, x'00')", rows)
        database.commit()
    with Ros2BagReader(file) as bag:
        texts = [each.header["message_definition"] for each in bag.connections if "/more" in each.topic]
        assert len(texts) == 3
        assert all(text is texts[0] for text in texts)
        assert [name for name in bag.skipped if "topic" in name][9:] == [
            "topic 1009",
            "each of 20 more topics",
        ]


def test_types_of_ros2_that_are_only_in_the_bag_are_converted_with_genuine_hashes(tmp_path: Path) -> None:
    kinds = {"bool": "bool", "integer": "int64", "double": "float64", "string": "string"}
    fields = [f"{kind} {name}_value" for name, kind in kinds.items()]
    fields += [f"{kind}[] {name}_array_value" for name, kind in ({"byte": "byte"} | kinds).items()]
    texts = {
        "ParameterEvent": "builtin_interfaces/Time stamp\nstring node\n"
        + "".join(f"Parameter[] {each}_parameters\n" for each in ("new", "changed", "deleted")),
        "Parameter": "string name\nParameterValue value",
        "ParameterValue": "\n".join(["uint8 type", *fields]),
    }
    folder = tmp_path / "share/rcl_interfaces/msg"
    folder.mkdir(parents=True)
    for name, text in texts.items():
        (folder / f"{name}.msg").write_text(text)
    with closing(sqlite3.connect("run.db3")) as database:
        database.executescript(
            "CREATE TABLE topics(id INTEGER, name, type, serialization_format, offered_qos_profiles);"
            "CREATE TABLE messages(id INTEGER, topic_id, timestamp, data);"
            "INSERT INTO topics VALUES(1, '/events', 'rcl_interfaces/msg/ParameterEvent', 'cdr', '');"
            f"INSERT INTO messages VALUES(1, 1, 9, x'00010000{'00' * 8}01000000{'00' * 16}');"
        )
    assert rosbag(["convert", "--msgs", "share", "run.db3", "run.bag"]) == 0  # it has only ROS 1 definitions
    assert rosbag(["convert", "--ros2", "jazzy", "run.bag", "jazzy"]) == 0
    [topic] = parse_metadata(Path("jazzy/metadata.yaml").read_text(), "x").topics
    assert topic.count == 1
    assert topic.type_hash == "RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204"
