"""What bags have beside messages: each cell of the table in docs/guides/bags.md, by running the command."""

# needs the plugins: data, ros2

import re
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml
import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer
from std_msgs.msg import Int32

from pipros.master.master import Master
from pipros_rosbag2.bags.reader import open_any_bag
from pipros_tools.bag import BagWriter
from pipros_tools.bag.records import MAGIC, U32, field_bytes
from pipros_tools.cli.rosbag import main
from tests.support import documents
from tests.support.bags import bag_bytes, header_of
from tests.support.nodes import Inbox, MakeNode

COMMANDS = {
    "info": "info IN", "check": "check IN", "play": "", "filter": "filter IN OUT True",
    "convert": "convert -q IN OUT", "reindex": "reindex -q --output-dir OUT IN",
    "compress": "compress -q --output-dir OUT IN", "export": "export IN OUT",
    "table": "table -q IN /a -o out.csv", "query": "query -q IN 'SELECT data FROM a'",
    "merge": "merge -q IN -o OUT", "split": "split -q --every 1000s --output-dir OUT IN",
}  # fmt: skip
_READING = ("info", "check", "play", "export", "table", "query")
_IN_ONE_FOLDER = ("reindex", "compress", "split")


def write_bag(extra: Callable[[int], dict[str, str]] = lambda _: {}, **options: Any) -> str:
    with open("run.bag", "w+b") as file:
        writer = BagWriter(file, **options)
        for number in range(4):
            header = {**header_of(Int32(), "/a"), **{k: v.encode() for k, v in extra(number).items()}}
            connection = writer.add_connection("/a", header)
            writer.write_message(connection, 10, number, Int32(number))
        writer.finish()
    return "run.bag"


def publishers() -> str:
    return write_bag(lambda n: {"callerid": f"/node{n}", "latching": "1", "robot": "r2"})


def encrypted() -> str:
    data = bag_bytes([("/a", Int32(1), 1, 0)])
    size = int.from_bytes(data[len(MAGIC) : len(MAGIC) + 4], "little")
    end = len(MAGIC) + 8 + size
    padding = int.from_bytes(data[end - 4 : end], "little")
    more = field_bytes({"encryptor": b"rosbag/AesCbcEncryptor"})
    header = data[len(MAGIC) + 4 : end - 4] + more
    sizes = U32.pack(len(header)), U32.pack(padding - len(more))
    rest = b" " * (padding - len(more)) + data[end + padding :]
    Path("run.bag").write_bytes(MAGIC + sizes[0] + header + sizes[1] + rest)
    return "run.bag"


def write_mcap(beside: Callable[[Writer], object] = lambda _: None, **origin: int) -> str:
    with open("run.mcap", "wb") as file:
        writer = Writer(file, chunk_size=60)
        writer.start(profile="ros1")
        schema = writer.register_schema("std_msgs/Int32", "ros1msg", b"int32 data")
        channel = writer.register_channel("/a", "ros1", schema, {"md5sum": Int32._md5sum})
        for n in range(4):
            add = {"publish_time": 10**10 + n, **origin}
            writer.add_message(channel, 10**10 + n, n.to_bytes(4, "little"), **add)
        beside(writer)
        writer.finish()
    return "run.mcap"


def ros2_bag() -> Path:
    """Write a folder with one database: four messages on /a."""
    write_bag()
    folder = Path("made")
    assert main(["convert", "-q", "--ros2", "jazzy", "--storage", "sqlite3", "run.bag", str(folder)]) == 0
    Path("run.bag").unlink()
    return folder


def with_log() -> str:
    folder = ros2_bag()
    database = folder / "made_0.db3"
    with closing(sqlite3.connect(database, isolation_level=None)) as changed:
        changed.execute("PRAGMA journal_mode = WAL")
        row = changed.execute("SELECT * FROM messages ORDER BY timestamp DESC").fetchone()
        changed.execute("DELETE FROM messages WHERE id = ?", row[:1])
        changed.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        changed.execute("INSERT INTO messages VALUES (?, ?, ?, ?)", row)
        content, log = database.read_bytes(), Path(f"{database}-wal").read_bytes()
    database.write_bytes(content)
    Path(f"{database}-wal").write_bytes(log)
    return str(folder)


def with_shared_memory() -> str:
    folder = ros2_bag()
    (folder / "made_0.db3-shm").write_bytes(bytes(32768))
    return str(folder)


def changed_metadata(change: Callable[[Any], object]) -> str:
    folder = ros2_bag()
    path = folder / "metadata.yaml"
    values = yaml.safe_load(path.read_text())
    change(values["rosbag2_bagfile_information"])
    path.write_text(yaml.safe_dump(values))
    return str(folder)


def with_qos() -> str:
    folder = ros2_bag()
    text = "- reliability: best_effort\n  durability: transient_local\n  depth: 7\n  history: keep_last\n"
    with closing(sqlite3.connect(folder / "made_0.db3")) as database, database:
        database.execute("UPDATE topics SET offered_qos_profiles = ?", [text])
    metadata = folder / "metadata.yaml"
    profiles = yaml.safe_dump(yaml.safe_load(text), default_flow_style=True)
    metadata.write_text(metadata.read_text().replace("profiles: []", f"profiles: {profiles.strip()}"))
    return str(folder)


def in_two_files() -> str:
    folder = ros2_bag()
    shutil.copy(folder / "made_0.db3", folder / "made_1.db3")
    for number, where in enumerate(("timestamp >= 10000000003", "timestamp < 10000000003")):
        with closing(sqlite3.connect(folder / f"made_{number}.db3")) as database, database:
            database.execute(f"DELETE FROM messages WHERE {where}")  # noqa: S608 # a constant
    text = (folder / "metadata.yaml").read_text()
    (folder / "metadata.yaml").write_text(text.replace("- made_0.db3", "- made_0.db3\n  - made_1.db3", 1))
    return str(folder)


def compressed() -> str:
    more = {"compression_format": "zstd", "compression_mode": "FILE"}
    folder = changed_metadata(lambda values: values.update(more, relative_file_paths=["made_0.db3.zstd"]))
    database = Path(folder, "made_0.db3")
    Path(folder, "made_0.db3.zstd").write_bytes(zstandard.compress(database.read_bytes()))
    database.unlink()
    return folder


def messages(path: Path) -> list[int]:
    with open_any_bag(path) as bag:
        return [each.message.data for each in bag]


def headers(path: Path) -> Any:
    with open_any_bag(path) as bag:
        found = sorted(tuple(sorted(each.header.items())) for each in bag.connections)
        return found if b"r2" in str(found).encode() else None


def qos(path: Path) -> Any:
    if path.is_dir():
        values = yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
        profiles = values["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"]
        return [each["depth"] for each in profiles]
    with open_any_bag(path) as bag:
        texts = [each.header.get("offered_qos_profiles", b"") for each in bag.connections]
        return texts if b"depth: 7" in texts[0] else None


def chunks(path: Path) -> Any:
    with open_any_bag(path) as bag:
        headers = [bag.chunk_header(number) for number in range(len(bag.chunks))]
        return [(each.compression, each.size) for each in headers]


def in_mcap(found: Callable[[Any], Any]) -> Callable[[Path], Any]:
    def state(path: Path) -> Any:
        for file in [*path.glob("*.mcap"), path]:
            if file.suffix == ".mcap":
                with file.open("rb") as opened:
                    return found(make_reader(opened))
        return None

    return state


def statistics(reader: Any) -> Any:
    return reader.get_summary().statistics


def unused(reader: Any) -> Any:
    summary = reader.get_summary()
    used = {each.schema_id for each in summary.channels.values()}
    return [each.name for each in summary.schemas.values() if each.id not in used]


def of_messages(name: str) -> Callable[[Any], Any]:
    return lambda reader: [value for *_, each in reader.iter_messages() if (value := getattr(each, name)) > 9]


def custom_data(path: Path) -> Any:
    if not path.is_dir():
        return None
    return yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]["custom_data"]


@dataclass(frozen=True)
class Beside:
    """A row: how to write a bag that has it, a pattern that names it, and what a bag has of it."""

    make: Callable[[], str]
    named: str
    state: Callable[[Path], Any] = lambda _: None
    targets: tuple[str, ...] = ("out.bag", "out.mcap")
    effect: str = "(?!)"


ROS2 = (*Beside.targets, "ros2")
ROWS = {
    "connection headers": Beside(publishers, r"\(4 connections\)|callerid.* are left out", headers, ROS2),
    "chunk info": Beside(lambda: write_bag(compression="lz4", chunk_bytes=30), r"compression: +lz4", chunks),
    "encryptor": Beside(encrypted, "is encrypted"),
    "attachments": Beside(
        lambda: write_mcap(lambda writer: writer.add_attachment(1, 2, "a.yaml", "text/yaml", b"x: 1")),
        "1 attachments", in_mcap(lambda reader: list(reader.iter_attachments())), ROS2,
    ),
    "metadata": Beside(
        lambda: write_mcap(lambda writer: writer.add_metadata("weather", {"rain": "no"})),
        "1 metadata records",
        in_mcap(lambda reader: [each for each in reader.iter_metadata() if each.name != "rosbag2"]), ROS2,
    ),
    "statistics": Beside(
        write_mcap, r"messages: +4\n", lambda path: in_mcap(statistics)(path) or chunks(path)
    ),
    "sequence numbers": Beside(
        lambda: write_mcap(sequence=17), "sequence numbers", in_mcap(of_messages("sequence")), ROS2
    ),
    "publish times": Beside(
        lambda: write_mcap(publish_time=12), "publish times", in_mcap(of_messages("publish_time")), ROS2
    ),
    "schemas without a channel": Beside(
        lambda: write_mcap(lambda writer: writer.register_schema("std_msgs/Bool", "ros1msg", b"bool data")),
        "1 schemas without a channel", in_mcap(unused), ROS2,
    ),
    "write-ahead log (`-wal`), journal (`-journal`)": Beside(
        with_log, "(?!)", messages, ROS2, r"(?m)[ ,]4$|\b3$"
    ),
    "its index (`-shm`)": Beside(with_shared_memory, "shm"),
    "custom data": Beside(
        lambda: changed_metadata(lambda values: values.update(custom_data={"site": "hall"})),
        "1 custom data", custom_data, ROS2,
    ),
    "QoS profiles": Beside(with_qos, "qos|QoS", qos, ROS2),
    "several files": Beside(in_two_files, "(?!)", messages, ROS2, r"(?m)[ ,]4$|\b3$"),
    "compressed files": Beside(compressed, "compressed with zstd"),
}  # fmt: skip


def table() -> dict[str, dict[str, str]]:
    lines = documents.text_of("guides/bags.md").splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("| beside messages"))
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[start:]]
    rows = rows[: next(n for n, row in enumerate(rows) if len(row) == 1)]
    names = rows[0][1:]
    return {row[0].partition(": ")[2]: dict(zip(names, row[1:], strict=True)) for row in rows[2:]}


TABLE = table()


def test_the_table_has_every_row_and_command() -> None:
    assert list(TABLE) == list(ROWS)
    assert {tuple(row) for row in TABLE.values()} == {tuple(COMMANDS)}


@pytest.mark.parametrize("command", [name for name in COMMANDS if name != "play"])
@pytest.mark.parametrize("row", ROWS)
def test_each_cell_is_true(row: str, command: str, tmp_path, monkeypatch, capfd) -> None:
    monkeypatch.chdir(tmp_path)
    beside = ROWS[row]
    source = beside.make()
    kept = {each: each.read_bytes() for each in Path(source).parent.rglob("*") if each.is_file()}
    before = "none" if "encrypt" in row or "compressed" in row else _before(beside, Path(source))
    capfd.readouterr()
    outcomes = []
    targets = beside.targets if command in ("convert", "filter", "merge") else ("out",)
    for target in targets if command == "convert" else [each for each in targets if each != "ros2"]:
        names = {"IN": source, "OUT": target}
        words = [names.get(each, each.strip("'")) for each in re.findall(r"'[^']*'|\S+", COMMANDS[command])]
        words += ["--ros2", "jazzy"] if target == "ros2" else []
        code = main(words)
        shown = "".join(capfd.readouterr())
        for name in Path("out").rglob("*.csv") if command == "export" else Path().glob("out.csv"):
            shown += name.read_text()
        outcome = "-"
        if re.search(beside.named, shown):
            outcome = "named"
        elif command in _READING:
            outcome = "kept" if re.search(beside.effect, shown) else "-"
        elif code == 0:
            made = Path(target)
            if command in _IN_ONE_FOLDER:
                made = next((each for each in made.rglob("metadata.yaml")), None) or next(made.iterdir())
                made = made.parent if made.name == "metadata.yaml" else made
            after = beside.state(made)
            outcome = "-" if not after else "kept" if after == before else "converted"
        assert code == 0 or outcome == "named" or command == "compress", shown
        outcomes.append(outcome)
    assert ", ".join(dict.fromkeys(outcomes)) == TABLE[row][command], (targets, outcomes)
    assert all(path.read_bytes() == data for path, data in kept.items())


def _before(beside: Beside, path: Path) -> Any:
    found = beside.state(path)
    if beside.effect != "(?!)":
        assert found == [0, 1, 2, 3]
    return found


@pytest.mark.parametrize("row", ROWS)
def test_each_cell_of_play_is_true(row, ros, master: Master, make_node: MakeNode, monkeypatch, capfd) -> None:
    monkeypatch.chdir(ros.home)
    source = ROWS[row].make()
    expected = TABLE[row]["play"]
    listener, early, late = make_node("listener"), Inbox(), Inbox()
    is_heard = expected in ("kept", "converted")
    words = ("--wait-for-subscribers", "-k") if is_heard else ()
    if is_heard:
        listener.subscribe("/a", Int32, early)
    play = ros.pipros.start("rosbag", "play", "-i", *words, source, ROS_MASTER_URI=master.uri)
    if not is_heard:
        play.wait()
        is_named = re.search(ROWS[row].named, play.output) is not None
        assert ("named" if is_named else "-") == expected
        return
    assert sorted(each.data for each in early.wait(4)) == [0, 1, 2, 3]
    if row in ("connection headers", "QoS profiles"):
        make_node("late").subscribe("/a", Int32, late)  # what is latched is also received later
        count = 4 if row == "connection headers" else 1
        assert len(late.wait(count)) == count
    play.press_ctrl_c()
    play.wait()
