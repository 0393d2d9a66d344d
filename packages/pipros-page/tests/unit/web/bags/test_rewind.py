"""The last minute of the running system, which browsers open like a bag."""

import asyncio
import contextlib
import io
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64, String

from pipros.msg.base import Message
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_page.bags.export import export
from pipros_page.bags.open_bags import OpenBags
from pipros_page.bags.playback import BagPlayback
from pipros_page.bags.rewind import OVERHEAD_BYTES, RecentMessages, Recording
from pipros_page.bounded_list import PAGE_VIEW_BYTES
from pipros_page.views.bags import PAGE_REWINDS, BagViews
from pipros_page.views.rewind import RewindViews
from pipros_page.watched_system import WatchedSystem
from pipros_server.browser_share import set_current_browser
from pipros_server.view_server import RequestRefused
from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.errors import NoMessages
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.observer import GraphObservation
from pipros_tools.graph.system_state import SystemState
from tests.support.waiting import wait_until

BYTES = 1_000_000


def raw(message: Message, **header: str) -> AnyMsg:
    """Return a message as it arrives from a publisher."""
    body = io.BytesIO()
    message.serialize(body)
    found = AnyMsg(body.getvalue())
    kind = {"type": message._type, "md5sum": message._md5sum, "message_definition": message._full_text}
    found._connection_header = {"callerid": "/a", **kind, **header}
    return found


def values(recording: Recording) -> list[tuple[str, float]]:
    """Return the topics and the numbers or texts of all messages, in the order of time."""
    return [(topic, message.data) for topic, message, _, _ in recording.messages()]


def test_the_recording_has_the_messages_in_the_order_of_time_and_ends_now() -> None:
    recent, now = RecentMessages(60, BYTES), time.time()
    recent.add("/b", raw(Float64(2)), now - 1)
    recent.add("/a", raw(Float64(1)), now - 2)
    recording = recent.recording()
    assert (values(recording), recording.message_count) == ([("/a", 1.0), ("/b", 2.0)], 2)
    assert recording.size == 16
    assert recording.range_ns[0] == round((now - 2) * NS_PER_S)
    assert recording.range_ns[1] >= round(now * NS_PER_S)
    assert sorted(recording.count_by_connection().values()) == [1, 1]
    assert sorted(map(len, recording.times_ns().values())) == [1, 1]
    a = recording.connections_of("/a")
    assert [each.time_ns for each in recording.again().stored_messages(a)] == [recording.range_ns[0]]
    assert list(recording.stored_messages(a, recording.range_ns[0] + 1)) == []


def test_messages_are_dropped_when_they_are_too_old() -> None:
    recent, now = RecentMessages(10, BYTES), time.time()
    recent.add("/a", raw(Float64(1)), now - 11)
    recent.add("/a", raw(Float64(2)), now - 5)
    assert (values(recent.recording()), recent.figures()[0]) == ([("/a", 2.0)], pytest.approx(5, abs=2))


def test_the_oldest_messages_are_dropped_at_the_limit_of_bytes_and_all_memory_is_counted() -> None:
    size = 1000
    recent, now = RecentMessages(60, 10 * size), time.time()
    for number in range(100):
        recent.add(
            "/a", raw(String(f"{number:03d}".ljust(size - OVERHEAD_BYTES - 4)), callerid=f"/n{number}"), now
        )
        assert recent.figures()[1] <= 10 * size
    kept = [int(text) for _, text in values(recent.recording())]
    assert kept == list(range(100 - len(kept), 100))
    assert len(kept) >= 5


def test_a_message_above_the_limit_does_not_remove_the_others() -> None:
    recent, now = RecentMessages(60, 10_000), time.time()
    recent.add("/a", raw(Float64(1)), now)
    recent.add("/a", raw(String("x" * 10_000)), now)
    assert values(recent.recording()) == [("/a", 1.0)]


def test_the_last_latched_message_of_each_publisher_stays_from_the_beginning_on() -> None:
    recent, now = RecentMessages(10, BYTES), time.time()
    for number, publisher in enumerate(("/a", "/a", "/b")):
        recent.add("/map", raw(Float64(number), callerid=publisher, latching="1"), now - 100 + number)
    recent.add("/other", raw(Float64(9)), now - 3)
    recording = recent.recording()
    assert values(recording) == [("/map", 1.0), ("/map", 2.0), ("/other", 9.0)]
    assert recording.range_ns[0] == round((now - 3) * NS_PER_S)
    assert [each.time_ns for each in recording.stored_messages()] == [recording.range_ns[0]] * 3


def test_latched_messages_do_not_exceed_the_limit_either() -> None:
    recent = RecentMessages(10, 10_000)
    for number in range(100):
        recent.add(
            "/map", raw(String("x" * 1000), callerid=f"/n{number}", latching="1"), 1000.0 + 20 * number
        )
        assert recent.figures()[1] <= 10_000


def test_without_messages_there_is_nothing_to_show() -> None:
    with pytest.raises(NoMessages, match="no message has been received yet"):
        RecentMessages(60, BYTES).recording()


def test_a_recording_is_exported_as_a_bag() -> None:
    recent, file = RecentMessages(60, BYTES), io.BytesIO()
    recent.add("/a", raw(Float64(1)), time.time())
    recording = recent.recording()
    export(recording, {"/a"}, recording.range_ns, "bag", file, BYTES)
    with BagReader(file) as bag:
        assert [(topic, message.data) for topic, message, _, _ in bag.messages()] == [("/a", 1.0)]


class Rewound:
    """A system with a minute of the topic `/number`, on whose page a browser can look back."""

    def __init__(self) -> None:
        self.recent = RecentMessages(60, BYTES)
        self.system = WatchedSystem(GraphClient("test"), Node("test"), recent=self.recent)
        self.now = time.time()
        for second in range(60, 0, -1):
            self.recent.add("/number", raw(Float64(-second)), self.now - second)


@pytest.fixture
def rewound() -> Rewound:
    return Rewound()


@pytest.fixture
def playback(rewound: Rewound) -> Iterator[BagPlayback]:
    found = BagPlayback(rewound.system, rewound.recent.recording())
    yield found
    found.close()


def test_the_playback_begins_at_the_end_and_jumps_back(rewound: Rewound, playback: BagPlayback) -> None:
    for jump, shown in ((0, -1.0), (10.5, -11.0)):
        playback.jump(round((rewound.now - jump) * NS_PER_S) if jump else playback.end_ns)
        with playback.system.topics.watch("/number") as watch:
            wait_until(lambda: watch.newest is not None)
            assert watch.decode(watch.newest.message).data == shown  # type: ignore[attr-defined]


def test_a_topic_that_was_not_recorded_says_so(playback: BagPlayback) -> None:
    with contextlib.ExitStack() as stack:
        what = "/scan was not recorded: no view showed it in the recorded time"
        with pytest.raises(RequestRefused, match=what):
            stack.enter_context(playback.system.topics.watch("/scan"))
    with playback.system.topics.watch("/tf"):  # tabs say themselves that there are no frames
        pass


@pytest.mark.parametrize(("recorded", "shown"), [([], -10), ([5], 5)])
def test_the_clock_is_the_recorded_one_or_else_the_moment(rewound, recorded: list[int], shown: int) -> None:
    for second in recorded:
        clock = Clock()
        clock.clock.secs = second
        rewound.recent.add("/clock", raw(clock), rewound.now - 20)
    playback = BagPlayback(rewound.system, rewound.recent.recording())
    playback.jump(round((rewound.now - 10) * NS_PER_S))
    with playback.system.topics.watch("/clock") as watch:
        wait_until(lambda: watch.newest is not None)
        time_s = watch.decode_as(watch.newest.message, Clock).clock.to_sec()
        assert time_s == pytest.approx(shown if shown > 0 else rewound.now + shown, abs=0.01)
    playback.close()


def views_of(system: WatchedSystem) -> BagViews:
    return BagViews(system, None, OpenBags())


async def opened(views: BagViews, stack: contextlib.AsyncExitStack) -> Any:
    """Look back within the context. Return the description."""
    view = await stack.enter_async_context(contextlib.aclosing(views.bag({"rewind": True})))  # type: ignore[type-var]
    while "bag" not in (value := await anext(view)):
        pass
    return value["bag"]


def test_browsers_look_back_up_to_a_limit_and_what_they_watched_is_recorded_on(rewound, monkeypatch) -> None:
    monkeypatch.setattr(rewound.system.topics, "update", lambda: None)  # there is no master
    views, limit = views_of(rewound.system), PAGE_REWINDS

    async def look_back(others: contextlib.AsyncExitStack) -> Any:
        set_current_browser()
        return await opened(views, others)

    async def check() -> None:
        set_current_browser()
        async with contextlib.AsyncExitStack() as stack:
            watching = stack.enter_context(contextlib.ExitStack())
            watching.enter_context(rewound.system.topics.watch("/scan"))
            bag = await opened(views, stack)
            assert bag["rewind"]
            assert bag["end"] - bag["begin"] == pytest.approx(60, abs=5)
            assert [track["topic"] for track in bag["tracks"]] == ["/number"]
            watching.close()
            assert [each.topic for each in rewound.system.topics.watches()] == ["/scan"]
            curve = views.bag_curve({"field": "/number/data"})
            samples = [sample async for piece in curve for sample in piece["samples"]]
            assert [sample[1] for sample in samples][-2:] == [-2.0, -1.0]
            for _ in range(limit - 1):
                await asyncio.create_task(look_back(stack))
            with pytest.raises(
                RequestRefused, match=f"too many browsers are showing the past; the limit is {limit}$"
            ):
                await asyncio.create_task(look_back(stack))
        assert rewound.system.topics.watches() == []

    asyncio.run(check())


def test_without_a_recording_nothing_can_be_rewound() -> None:
    system = WatchedSystem(GraphClient("test"), Node("test"))
    views = views_of(system)

    async def check() -> None:
        set_current_browser()
        assert [each async for each in RewindViews(system).rewind({})] == [{"span": 0}]
        async with contextlib.AsyncExitStack() as stack:
            with pytest.raises(RequestRefused, match="the past is not recorded; start the command without"):
                await opened(views, stack)

    asyncio.run(check())


def test_a_connected_browser_keeps_published_topics_recorded_and_the_past_is_dropped_after_the_last(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    span_s = 0.2
    recent = RecentMessages(span_s, BYTES)
    system = WatchedSystem(GraphClient("test"), Node("test"), recent=recent)
    monkeypatch.setattr(system.topics, "update", lambda: None)  # there is no master
    seen = iter([{"/tf": ["/a"], "/scan": ["/a"]}, {"/rosout_agg": ["/a"]}])

    async def observations() -> AsyncIterator[GraphObservation]:
        for publishers in seen:
            yield GraphObservation(state=SystemState(publishers, {}, {}))

    monkeypatch.setattr(system, "observations", observations)

    async def check() -> None:
        view = RewindViews(system).rewind({})
        watched = []
        for _ in range(2):
            assert (await anext(view))["span"] == span_s
            watched.append([each.topic for each in system.topics.watches()])
        assert watched == [["/tf"], ["/rosout_agg"]]
        await view.aclose()  # type: ignore[attr-defined]
        assert system.topics.watches() == []
        recent.add("/map", raw(Float64(1), latching="1"), time.time())
        while recent.figures()[1]:  # a latched message does not become too old
            await asyncio.sleep(0.01)

    asyncio.run(asyncio.wait_for(check(), 30))


# Reading a bag for a browser that jumps between times.


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
