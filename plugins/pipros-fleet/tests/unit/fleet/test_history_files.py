"""Files of a history: their messages, their size limit, and their names."""

import os
import threading
from dataclasses import astuple
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros_fleet.history_files import (
    COMPLETION_S,
    FILE_BYTES,
    SMALLEST_LIMIT_BYTES,
    HistoryFile,
    HistoryFiles,
    is_file_name,
    read_rows,
)
from pipros_fleet.limits import FleetLimits
from pipros_page.bags.folder import BagFolder
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.mcap_files import McapReader
from pipros_tools.bag.opening import open_bag
from tests.support.constants import Constants
from tests.support.full_disk import files_limited_to

String: Any = load_message_class("std_msgs/String")
S = 1_000_000_000


def connection(topic: str, *, latching: bool = False) -> Connection:
    header = {"type": "std_msgs/String", "md5sum": String._md5sum, "message_definition": String._full_text}
    header |= {"callerid": "/robot1/0", "latching": "1" if latching else "0"}
    return Connection(0, topic, {name: value.encode() for name, value in header.items()})


def body(text: str) -> bytes:
    return b"".join(String(text)._to_buffers())


def texts(path: Path) -> list[tuple[str, str]]:
    with open_bag(path) as bag:
        return [(each.connection.topic, each.message.data) for each in bag.messages()]


def test_files_can_be_read_while_recording_continues(tmp_path: Path) -> None:
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES)
    map_topic, odometry = connection("/robot1/map", latching=True), connection("/robot1/odom")
    files.write("robot1", map_topic, 1 * S, body("map"))
    files.write("robot1", odometry, 2 * S, body("first"))
    (first,) = files.list("robot1")
    assert (first.messages, first.begin_ns, first.end_ns) == (2, 1 * S, 2 * S)
    files.write("robot1", odometry, 3 * S, body("second"))
    files.close()

    names = [each.name for each in files.list("robot1")]
    assert texts(tmp_path / "robot1" / names[0]) == [("/robot1/map", "map"), ("/robot1/odom", "first")]
    assert texts(tmp_path / "robot1" / names[1]) == [("/robot1/map", "map"), ("/robot1/odom", "second")]
    assert files.read("robot1", names[0]) == (tmp_path / "robot1" / names[0]).read_bytes()
    assert {name for name, _ in BagFolder(tmp_path).names()} == {f"robot1/{name}" for name in names}
    assert files.list("robot2") == []


@pytest.mark.needs("resource limits")
def test_a_full_disk_names_the_member_and_other_files_are_completed(tmp_path: Path) -> None:
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES)
    files.write("robot2", connection("/robot2/odom"), 1 * S, body("kept"))
    files.write("robot0", connection("/robot0/odom"), 1 * S, body("kept"))
    large = body(os.urandom(70_000).hex())
    with files_limited_to(50_000):
        with pytest.raises(OSError, match=r"robot1'$"):
            files.write("robot1", connection("/robot1/odom"), 1 * S, large)
        with pytest.raises(OSError, match=r"robot1'$"):
            files.close()

    for member in ("robot0", "robot2"):
        (file,) = files.list(member)
        assert texts(tmp_path / member / file.name) == [(f"/{member}/odom", "kept")]


def test_requests_complete_a_file_only_at_intervals(tmp_path: Path) -> None:
    now_s = 100.0
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES, clock=lambda: now_s)
    map_topic = connection("/robot1/map", latching=True)
    for number in range(5):
        files.write("robot1", map_topic, number * S, body("map"))
        assert len(files.list("robot1")) == 1
    files.write("robot2", connection("/robot2/odom"), 1 * S, body("other"))
    assert len(files.list("robot2")) == 1
    now_s += COMPLETION_S
    assert len(files.list("robot1")) == 2
    files.close()


def test_files_are_described_while_another_thread_writes(tmp_path: Path, monkeypatch) -> None:
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES)
    files.write("robot1", connection("/robot1/odom"), 1 * S, body("first"))
    files.close()
    (tmp_path / "robot1" / "removed.mcap").symlink_to("missing")

    class SlowReader(McapReader):
        """Reader that returns once another thread has written."""

        def __init__(self, path: Path) -> None:
            writer = threading.Thread(
                target=files.write, args=("robot2", connection("/robot2/odom"), 1 * S, b""), daemon=True
            )
            writer.start()
            writer.join(60)
            assert not writer.is_alive()
            super().__init__(path)

    monkeypatch.setattr("pipros_fleet.history_files.McapReader", SlowReader)
    assert [each.messages for each in files.list("robot1")] == [1]
    files.close()


def test_the_member_with_the_largest_files_loses_its_oldest_one(tmp_path: Path) -> None:
    (tmp_path / "robot2").mkdir()
    old = tmp_path / "robot2" / "of_a_killed_router.mcap.active"
    old.write_bytes(b"x")
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES)
    noisy = connection("/robot1/image")
    for number in range(12):
        files.write("robot1", noisy, number * S, os.urandom(FILE_BYTES // 2))  # does not compress
    files.close()
    sizes = [path.stat().st_size for path in tmp_path.glob("*/*.mcap*")]
    assert sum(sizes) <= SMALLEST_LIMIT_BYTES
    assert old.exists()
    kept = files.list("robot1")
    assert 0 < kept[0].begin_ns < kept[-1].end_ns == 11 * S


def test_the_current_file_may_be_deleted(tmp_path: Path) -> None:
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES)
    for number in range(12):
        member = f"robot{number}"
        files.write(member, connection("/image"), number * S, os.urandom(FILE_BYTES // 2))
    files.close()
    assert sum(path.stat().st_size for path in tmp_path.glob("*/*")) <= SMALLEST_LIMIT_BYTES
    (lost, *_) = [number for number in range(12) if not files.list(f"robot{number}")]
    files.write(f"robot{lost}", connection("/image"), 12 * S, b"")
    assert files.list(f"robot{lost}")[0].messages == 1


def killed(folder: Path, member: str, *lines: str) -> Path:
    """Play a router that writes messages and is killed. Return the file that it leaves."""
    files = HistoryFiles(folder, SMALLEST_LIMIT_BYTES)
    for number, line in enumerate(lines):
        files.write(member, connection(f"/{member}/odom"), number * S, body(line))
    (left,) = (folder / member).glob("*.active")
    content = left.read_bytes()
    files.close()
    (complete,) = (folder / member).iterdir()
    complete.unlink()
    left.write_bytes(content)
    return left


def test_files_of_a_killed_router_are_completed(tmp_path: Path) -> None:
    large = os.urandom(50_000).hex()  # does not fit into a chunk with others
    left = killed(tmp_path, "robot1", f"first {large}", f"second {large}", "in memory")
    os.utime(left, ns=(5 * S, 5 * S))
    empty = killed(tmp_path, "robot2", "in memory")
    strange = left.with_name("strange.mcap.active")
    strange.mkdir()
    unfinished = left.with_name(f"{left.name}.active")
    unfinished.write_bytes(b"from an interrupted recovery")

    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES)
    files.write("robot1", connection("/robot1/odom"), 9 * S, body("after the restart"))
    assert not unfinished.exists()
    files.recover()

    (found,) = files.list("robot1")[:1]
    assert (found.name, found.messages, found.begin_ns, found.end_ns) == (left.stem, 2, 0, 1 * S)
    path = left.with_suffix("")
    assert [text.partition(" ")[0] for _, text in texts(path)] == ["first", "second"]
    assert path.stat().st_mtime_ns == 5 * S
    assert not empty.parent.exists()
    assert strange.exists()
    assert [text for each in files.list("robot1")[1:] for _, text in texts(path.with_name(each.name))] == [
        "after the restart"
    ]


def test_files_of_a_killed_router_count_toward_the_limit(tmp_path: Path) -> None:
    left = killed(tmp_path, "robot1", "in memory")
    os.truncate(left, SMALLEST_LIMIT_BYTES)
    os.utime(left, ns=(5 * S, 5 * S))
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES)
    files.write("robot2", connection("/robot2/odom"), 9 * S, body("new"))
    assert not left.parent.exists()
    files.close()


def test_the_member_with_the_most_files_loses_its_oldest_ones(tmp_path: Path, constants: Constants) -> None:
    constants(FLEET_HISTORY_FILES=10)
    limits = process_limits().with_table(FleetLimits())
    files = HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES, limits=limits)
    files.write("robot1", connection("/robot1/odom"), 0, body("few"))
    for number in range(30):
        files.write("robot2", connection("/robot2/odom"), number * S, body("many"))
        files.forget("robot2")
        for each in (tmp_path / "robot2").iterdir():
            if each.stat().st_mtime_ns > number * S:  # one that was just written
                os.utime(each, ns=(number * S, number * S))
        assert len(list(tmp_path.glob("*/*"))) <= 11
    assert [each.messages for each in files.list("robot1")] == [1]
    assert files.list("robot2")[-1].end_ns == 29 * S
    files.close()


def test_too_small_a_limit_raises(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="the limit must be >= 33554432 bytes, got 5"):
        HistoryFiles(tmp_path, 5)


@pytest.mark.parametrize("name", ["../x.mcap", "/etc/passwd", "a/b.mcap", "x.bag", ".mcap", "a\n.mcap"])
def test_names_with_paths_are_refused(tmp_path: Path, name: str) -> None:
    assert not is_file_name(name)
    assert HistoryFiles(tmp_path, SMALLEST_LIMIT_BYTES).read("robot1", name) is None


def test_rows_of_a_router_are_checked() -> None:
    good = HistoryFile("a.mcap", 1, 2, 3, 4)
    wrong = [["../a.mcap", 1, 2, 3, 4], ["b.mcap", "1", 2, 3, 4], ["c.mcap"], 5]
    assert (list(read_rows([*wrong, list(astuple(good))])), list(read_rows({}))) == ([good], [])
