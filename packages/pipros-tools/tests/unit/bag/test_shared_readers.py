"""Threads, forked processes and pickled copies read the same messages from every kind of bag."""

# needs the plugins: data, ros2

import multiprocessing
import pickle
import sqlite3
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from threading import Barrier
from typing import Any

import pytest
from sensor_msgs.msg import Image

import rosbag
from pipros_data import open_bags
from pipros_rosbag2.bags.reader import open_any_bag
from pipros_tools.bag import BagWriter
from pipros_tools.bag.bag_file import BagFile
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.reader import BagReader
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, header_of, old_bag_bytes

COUNT = 24
WORKERS = 8
KINDS = ("none", "lz4", "bz2", "1.2", "mcap", "none.mcap", "ros2", "sqlite3", "wal")
Item = Callable[[int], bytes]
"""Returns the bytes of the image with the given number."""


def content(number: int) -> bytes:
    return bytes([number]) * (3000 + number)


def rows() -> list[tuple[str, Any, int, int]]:
    return [("/image", Image(data=content(number)), 100 + number, 0) for number in range(COUNT)]


def written(kind: str) -> Path:
    """Write a bag of this kind with images to the current folder."""
    bag = Path("run.bag")
    if kind == "1.2":
        bag.write_bytes(old_bag_bytes(rows()))
        return bag
    bag.write_bytes(
        bag_bytes(rows(), compression=kind if kind in ("lz4", "bz2") else "none", chunk_bytes=20_000)
    )
    if kind in ("none", "lz4", "bz2"):
        return bag
    if kind.endswith("mcap"):
        how = ["--compression=none"] if kind == "none.mcap" else []
        assert main(["convert", *how, "run.bag", "run.mcap"]) == 0
        return Path("run.mcap")
    storage = "mcap" if kind == "ros2" else "sqlite3"
    assert main(["convert", "--ros2", "jazzy", "--storage", storage, "run.bag", "run"]) == 0
    if kind == "wal":
        leave_log(Path("run/run_0.db3"))
    return Path("run")


def leave_log(database: Path) -> None:
    """Move the messages from a database to its write-ahead log, as if its recorder had been killed."""
    with closing(sqlite3.connect(database, isolation_level=None)) as changed:
        changed.execute("PRAGMA journal_mode = WAL")
        messages = changed.execute("SELECT * FROM messages").fetchall()
        changed.execute("DELETE FROM messages")
        changed.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        changed.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", messages)
        whole, log = database.read_bytes(), Path(f"{database}-wal").read_bytes()
    database.write_bytes(whole)
    Path(f"{database}-wal").write_bytes(log)


def reader_item(bag: BagReader) -> Item:
    return lambda number: b"".join(
        each.message.data for each in bag.messages("/image", 100 + number, 100 + number)
    )


def table_item(bags: Any) -> Item:
    return lambda number: b"".join(bags.table("/image", start=100 + number, end=100 + number)["data"])


def facade_item(bag: rosbag.Bag) -> Item:
    entries = next(iter(bag._connection_indexes.values()))
    return lambda number: b"".join(
        (
            bag._read_message(entries[number].position).message.data,
            *(
                each.message.data
                for each in bag.read_messages("/image", entries[number].time, entries[number].time)
            ),
        )
    )


def opened_bag(how: str, path: Path) -> tuple[Any, Callable[[Any], Item], int]:
    """Return an open bag, a function that returns its `Item`, and how often an item has the content."""
    if how == "facade":
        return rosbag.Bag(str(path)), facade_item, 2
    return (open_bags(path), table_item, 1) if how == "table" else (open_any_bag(path), reader_item, 1)


@pytest.fixture(
    params=[("facade", kind) for kind in KINDS[:4]]
    + [(how, kind) for how in ("reader", "table") for kind in KINDS],
    ids=" ".join,
)
def opened(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Any, Callable[[Any], Item], int]]:
    monkeypatch.chdir(tmp_path)
    how, kind = request.param
    bag, *rest = opened_bag(how, written(kind))
    with bag:
        yield bag, *rest


def wrong_items(item: Item, times: int, seed: int) -> list[object]:
    """Return the numbers of items that are another item, and errors. Workers read in different orders."""
    found: list[object] = []
    for at in range(COUNT):
        number = at * (2 * seed + 1) % COUNT
        try:
            if item(number) != content(number) * times:
                found.append(number)
        except (BagError, OSError, ValueError, rosbag.ROSBagException) as error:
            found.append(str(error))
    return found


def test_threads_read_the_items_that_they_ask_for(opened: tuple[Any, Callable[[Any], Item], int]) -> None:
    bag, get, times = opened
    item, start = get(bag), Barrier(WORKERS)

    def work(seed: int) -> list[object]:
        start.wait(30)
        return wrong_items(item, times, seed)

    with ThreadPoolExecutor(WORKERS) as threads:
        assert list(threads.map(work, range(WORKERS))) == [[]] * WORKERS


def test_forked_workers_read_the_items_that_they_ask_for(
    opened: tuple[Any, Callable[[Any], Item], int],
) -> None:
    bag, get, times = opened
    item = get(bag)
    context = multiprocessing.get_context("fork")
    start, results = context.Barrier(WORKERS), context.SimpleQueue()

    def work(seed: int) -> None:
        start.wait(30)
        results.put(wrong_items(item, times, seed))

    workers = [context.Process(target=work, args=(seed,), daemon=True) for seed in range(WORKERS)]
    for each in workers:
        each.start()
    found = [results.get() for _ in workers]
    for each in workers:
        each.join(30)

    assert found == [[]] * WORKERS
    assert wrong_items(item, times, 0) == []


def test_a_pickled_bag_opens_its_file_again(
    opened: tuple[Any, Callable[[Any], Item], int], monkeypatch: pytest.MonkeyPatch
) -> None:
    bag, get, times = opened
    packed = pickle.dumps(bag)
    bag.close()
    monkeypatch.chdir("/")

    with pickle.loads(packed) as copy:  # noqa: S301 # it was written above
        assert wrong_items(get(copy), times, 0) == []


def test_a_closed_bag_says_so(opened: tuple[Any, Callable[[Any], Item], int]) -> None:
    bag, get, _ = opened
    item = get(bag)
    item(0)
    bag.close()

    with pytest.raises(ValueError, match="closed"):
        item(1)


def test_a_bag_that_was_not_opened_by_its_path_is_not_pickled(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    path.write_bytes(bag_bytes(rows()[:2]))
    with path.open("rb") as file, BagReader(file) as bag, pytest.raises(TypeError, match="by its path"):
        pickle.dumps(bag)
    with rosbag.Bag(str(tmp_path / "new.bag"), "w") as written, pytest.raises(TypeError, match="for reading"):
        pickle.dumps(written)


def test_a_bag_is_read_while_it_is_written(tmp_path: Path) -> None:
    with (tmp_path / "a.bag").open("w+b") as file:
        bag = BagFile(file, "a.bag", "w", compression="none", chunk_bytes=1 << 20)
        assert isinstance(bag.writer, BagWriter)
        connection = bag.writer.add_connection("/image", header_of(Image(), "/image"))
        for number in range(5):
            bag.writer.write_message(connection, 100 + number, 0, Image(data=content(number)))
            assert reader_item(bag.view())(number) == content(number)
