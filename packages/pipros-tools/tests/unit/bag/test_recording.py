import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Int32

from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros_tools.bag import BagError, BagReader
from pipros_tools.bag.connection import StoredMessage, received_connection
from pipros_tools.bag.merge import merged
from pipros_tools.bag.options import FileOptions, RecordOptions
from pipros_tools.bag.playback_clock import PlaybackClock
from pipros_tools.bag.record_files import RecordFiles
from pipros_tools.bag.record_queue import RecordQueue
from pipros_tools.bag.recorder import Recorder, Snapshots
from tests.support.bags import bag_bytes, rows_of

HEADER = {"type": "std_msgs/Int32", "md5sum": Int32._md5sum, "message_definition": Int32._full_text}


def received(value: int, seconds: int = 0, **more: str) -> StoredMessage:
    connection = received_connection("/a", {**HEADER, **more})
    return StoredMessage(connection, seconds * NS_PER_S, value.to_bytes(4, "little"))


def test_a_full_queue_drops_the_oldest_and_counts_them() -> None:
    queue = RecordQueue(limit_bytes=10)
    for value in range(5):
        queue.put(received(value))

    assert [message.data[0] for message in queue.get_all(0)] == [3, 4]
    assert queue.dropped == 3
    queue.put(received(7))
    queue.close()
    queue.put(received(8))
    assert [message.data[0] for message in queue.get_all(1)] == [7]
    assert queue.get_all(100) == []


def test_an_unbounded_queue_drops_nothing() -> None:
    queue = RecordQueue(limit_bytes=0)
    for value in range(200):
        queue.put(received(value))
    assert (len(queue.get_all(0)), queue.dropped) == (200, 0)


def test_a_queue_may_keep_a_part_of_the_time() -> None:
    queue = RecordQueue(limit_bytes=0, limit_ns=5 * 10**9)
    for seconds in (1, 3, 6, 9, 14):
        queue.put(received(seconds, seconds))
    assert [message.data[0] for message in queue.get_all(0)] == [9, 14]


def test_a_snapshot_has_the_buffered_and_all_latched_messages(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    snapshots = Snapshots(FileOptions(name="snap", repeat_latched=True), RecordQueue(12), lambda _: None)
    with pytest.raises(BagError, match="no messages"):
        snapshots.write(0)
    snapshots.put(received(1, 1, latching="1", callerid="/one"))
    for value in range(2, 6):
        snapshots.put(received(value, value))

    assert snapshots.write(9 * NS_PER_S) == (Path("snap.bag"), 4)
    assert snapshots.write(9 * NS_PER_S) == (Path("snap_1.bag"), 1)
    with BagReader("snap.bag") as bag:
        assert sorted(rows_of(bag)) == [("/a", 1, 3, 0), ("/a", 3, 3, 0), ("/a", 4, 4, 0), ("/a", 5, 5, 0)]


def files(folder: Path, monkeypatch: pytest.MonkeyPatch, reports: list[str], **options: Any) -> RecordFiles:
    monkeypatch.chdir(folder)
    return RecordFiles(FileOptions(**options), reports.append)


def test_files_are_active_until_they_are_complete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reports: list[str] = []
    recording = files(tmp_path, monkeypatch, reports, name="run.bag")
    recording.open(5 * NS_PER_S)
    assert recording.write(received(1, 5))
    assert [path.name for path in tmp_path.iterdir()] == ["run.bag.active"]
    recording.close()
    recording.close()

    assert [path.name for path in tmp_path.iterdir()] == ["run.bag"]
    with BagReader(tmp_path / "run.bag") as bag:
        assert (rows_of(bag), bag.connections[0].header["topic"]) == ([("/a", 1, 5, 0)], b"/a")
    assert reports == ["Recording to 'run.bag'."]


@pytest.mark.skipif(os.name == "nt", reason="an open file cannot be replaced on Windows")
@pytest.mark.parametrize("change", [Path.unlink, lambda path: path.replace(path.with_name("moved"))])
def test_a_file_that_was_replaced_or_moved_meanwhile_is_not_called_complete(
    tmp_path: Path, monkeypatch, change: Callable[[Path], object]
) -> None:
    recording = files(tmp_path, monkeypatch, [], name="run", split=True, duration_s=10.0)
    recording.open(0)
    recording.write(received(1, 0))
    change(active := Path("run_0.bag.active"))
    active.write_text("other")
    with pytest.raises(FileNotFoundError, match=r"another program has replaced or moved 'run_0.bag.active'"):
        recording.write(received(2, 20))
    recording.write(received(3, 21))
    recording.close()
    assert active.read_text() == "other"
    with BagReader("run_1.bag") as bag:
        assert [row[1] for row in rows_of(bag)] == [3]


def test_a_split_begins_with_the_latched_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reports: list[str] = []
    recording = files(
        tmp_path, monkeypatch, reports, prefix="x", name="", split=True, duration_s=10.0, repeat_latched=True
    )
    recording.open(0)
    latched = received(1, 0, latching="1", callerid="/one")
    recording.write(latched)
    recording.write(received(2, 5))
    recording.write(received(3, 20))
    recording.close()

    first, second = sorted(tmp_path.iterdir())
    assert (first.name[:2], first.name[-6:], second.name[-6:]) == ("x_", "_0.bag", "_1.bag")
    with BagReader(first) as bag:
        assert [row[1] for row in rows_of(bag)] == [1, 2]
    with BagReader(second) as bag:
        assert rows_of(bag) == [("/a", 3, 20, 0), ("/a", 1, 20, 0)] or rows_of(bag) == [
            ("/a", 1, 20, 0),
            ("/a", 3, 20, 0),
        ]
    assert reports[1].startswith("Closing 'x_")


def test_a_split_that_failed_on_a_full_disk_is_retried(tmp_path: Path, monkeypatch) -> None:
    recording = files(tmp_path, monkeypatch, [], name="run", split=True, duration_s=10.0)
    recording.open(0)
    recording.write(received(1, 0))
    (tmp_path / "run_1.bag.active").mkdir()  # so that the file cannot be created
    for seconds in (20, 21):
        with pytest.raises(OSError, match="directory"):
            recording.write(received(2, seconds))
    (tmp_path / "run_1.bag.active").rmdir()
    recording.write(received(3, 22))
    recording.close()

    for name, value in (("run_0.bag", 1), ("run_1.bag", 3)):
        with BagReader(name) as bag:
            assert [row[1] for row in rows_of(bag)] == [value]


def test_without_a_split_a_full_file_ends_the_recording(tmp_path: Path, monkeypatch) -> None:
    recording = files(tmp_path, monkeypatch, [], name="run", size_bytes=4200)
    recording.open(0)
    results = [recording.write(received(n, n)) for n in range(10)]
    recording.close()

    assert results[0] is True
    assert results[-1] is False


def test_the_clock_of_a_playback_stops_in_a_pause_and_jumps() -> None:
    clock = PlaybackClock(100, 10, rate=2.0)
    assert (clock.due(104), clock.bag_time(11)) == (12, 102)
    clock.pause(12)
    clock.pause(13)
    assert (clock.is_paused, clock.bag_time(20)) == (True, 104)
    clock.resume(22)
    assert (clock.is_paused, clock.due(104), clock.bag_time(23)) == (False, 22, 106)
    clock.jump(500, 30)
    assert clock.due(502) == 31
    clock.pause(31)
    clock.jump(600, 40)
    assert clock.bag_time(50) == 600


def test_many_bags_are_one_in_time_order(tmp_path: Path) -> None:
    paths = []
    for number in range(3):
        path = tmp_path / f"{number}.bag"
        path.write_bytes(bag_bytes([(f"/{number}", Int32(n), 3 * n + number, 0) for n in range(10)]))
        paths.append(path)
    bags = [BagReader(path) for path in paths]
    found = [(message.topic, message.time.secs) for message in merged(bags, start=(3, 0), end=(20, 0))]
    some = list(merged(bags, lambda connection: connection.topic == "/1"))
    for bag in bags:
        bag.close()

    assert found == [(f"/{n % 3}", n) for n in range(3, 21)]
    assert [message.message.data for message in some] == list(range(10))


def test_a_recording_ends_with_a_complete_file_when_the_disk_is_nearly_full(tmp_path: Path) -> None:
    warnings: list[str] = []
    options = RecordOptions(
        min_space_bytes=1 << 60, ends_without_space=True, files=FileOptions(name=str(tmp_path / "full.bag"))
    )
    recorder = Recorder(Node("record"), options, say=lambda _: None, warn=warnings.append)

    assert recorder.run()

    assert [path.name for path in tmp_path.iterdir()] == ["full.bag"]
    assert "The recording ends." in warnings[0]
    assert (recorder.written, recorder.topics) == (0, 0)


def test_a_file_that_cannot_be_begun_is_named_and_removed(tmp_path: Path, monkeypatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("pipros_tools.bag.record_files.writer_for", fail)
    recording = files(tmp_path, monkeypatch, [], name="new.bag")
    with pytest.raises(OSError, match=r"No space left on device: 'new\.bag\.active'"):
        recording.open(0)
    assert list(tmp_path.iterdir()) == []
