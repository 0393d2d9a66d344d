"""Reading a bag for a browser that jumps between times."""

import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros_page.bags.playback import BagPlayback
from pipros_page.bounded_list import PAGE_VIEW_BYTES
from pipros_page.watched_system import WatchedSystem
from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.graph.client import GraphClient
from tests.support.waiting import wait_until

MARKERS, EMPTY = "visualization_msgs/MarkerArray", "std_msgs/Empty"
TOPIC = "/topic"


def write_bag(path: Path, type_name: str, sizes: Iterable[int]) -> Path:
    """Write a bag with one message per second, from 1000 on, of the given sizes (bytes)."""
    with path.open("wb") as file:
        writer = BagWriter(file)
        fields = {"topic": TOPIC, "type": type_name, "md5sum": "*", "message_definition": ""}
        connection = writer.add_connection(TOPIC, {key: value.encode() for key, value in fields.items()})
        for second, size in enumerate(sizes):
            writer.write(connection, 1000 + second, 0, bytes(size))
        writer.finish()
    return path


@pytest.fixture
def live() -> WatchedSystem:
    return WatchedSystem(GraphClient("test"), Node("test"))


@pytest.mark.parametrize(("share", "kept"), [(0.4, [1004, 1005]), (0.6, [1005]), (2.0, [1005])])
def test_a_jump_keeps_the_newest_messages_within_the_limit(
    live: WatchedSystem, tmp_path: Path, share: float, kept: list[int]
) -> None:
    size = int(PAGE_VIEW_BYTES * share)
    playback = BagPlayback(live, BagReader(write_bag(tmp_path / "a.bag", MARKERS, [size] * 6)))
    playback.jump(1005 * NS_PER_S)
    with playback.system.topics.watch(TOPIC) as watch:
        wait_until(lambda: watch.newest is not None and watch.newest.wall_s == 1005)
        received: list[float] = []
        with watch.listening(lambda _, wall_s: received.append(wall_s)):
            assert received == kept
    playback.close()


def test_a_view_that_listens_late_has_the_time_of_a_paused_bag(live: WatchedSystem, tmp_path: Path) -> None:
    playback = BagPlayback(live, BagReader(write_bag(tmp_path / "a.bag", EMPTY, [0] * 6)))
    playback.jump(1004 * NS_PER_S)
    with playback.system.topics.watch("/clock") as watch:
        wait_until(lambda: watch.newest is not None)
        received: list[float] = []
        with watch.listening(lambda _, wall_s: received.append(wall_s)):
            assert received == [1004]
    playback.close()


class EndlessReader(BagReader):
    """A bag whose first message is followed by itself until `stopped` is set.

    Attributes:
        readings: how often reading has begun.
        closed: set once the bag is closed.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.readings = 0
        self.stopped, self.closed = threading.Event(), threading.Event()

    def stored_messages(
        self,
        connections: Iterable[Connection] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Iterator[StoredMessage]:
        message = next(super().stored_messages(connections))
        self.readings += 1
        while not self.stopped.is_set():
            yield message

    def close(self) -> None:
        super().close()
        self.closed.set()


@pytest.fixture(params=[MARKERS, EMPTY])
def endless(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[EndlessReader]:
    """A bag of a type for which a jump reads many messages, or of one for which it reads only the newest."""
    reader = EndlessReader(write_bag(tmp_path / "a.bag", request.param, [0, 0]))
    yield reader
    reader.stopped.set()


def test_reading_stops_when_the_bag_is_closed(live: WatchedSystem, endless: EndlessReader) -> None:
    playback = BagPlayback(live, endless)
    with playback.system.topics.watch(TOPIC):
        wait_until(lambda: endless.readings)
        playback.close()
        wait_until(endless.closed.is_set)


def test_reading_stops_at_the_next_jump(live: WatchedSystem, endless: EndlessReader) -> None:
    playback = BagPlayback(live, endless)
    with playback.system.topics.watch(TOPIC):
        wait_until(lambda: endless.readings == 1)
        playback.jump(playback.end_ns)
        with playback.system.topics.watch(TOPIC):
            wait_until(lambda: endless.readings >= 2)
            playback.close()
            wait_until(endless.closed.is_set)


@pytest.mark.parametrize("end", [lambda playback: playback.jump(0), BagPlayback.close])
def test_a_jump_replaces_an_unfinished_step_backwards(
    live: WatchedSystem, endless: EndlessReader, end: Callable[[BagPlayback], None]
) -> None:
    playback = BagPlayback(live, endless)
    playback.jump(playback.end_ns)
    playback.step(-1, [])
    wait_until(lambda: endless.readings == 1)
    end(playback)
    epoch = playback.state.epoch
    playback.close()
    wait_until(endless.closed.is_set)
    assert playback.state.epoch == epoch
