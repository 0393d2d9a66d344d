"""Views of the Bags tab, without a server."""

import asyncio
import contextlib
import contextvars
import errno
import gc
import io
import os
import re
import struct
import tempfile
import threading
import zipfile
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from concurrent.futures import Future
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Float64

from pipros.msg import load_message_class
from pipros.node import Node
from pipros_page.bags import folder
from pipros_page.bags import opening as bag_opening
from pipros_page.bags.export import FORMATS, export
from pipros_page.bags.folder import BadBagName, BagFolder
from pipros_page.bags.newest import newest_before
from pipros_page.bags.open_bags import OpenBags
from pipros_page.bags.playback import BagPlayback
from pipros_page.bags.tracks import BINS, tracks
from pipros_page.views.bags import PAGE_BAGS, PAGE_EXPORTS, BagViews
from pipros_page.watched_system import COMPUTATIONS_AT_ONCE, WatchedSystem
from pipros_server.browser_share import set_current_browser
from pipros_server.view_server import RequestRefused, ServedViews
from pipros_tools.bag import BagError, BagReader, BagWriter
from pipros_tools.bag.opening import open_bag, writer_for
from pipros_tools.graph.client import GraphClient
from tests.support.bags import bag_bytes

EXPORT = {"name": "run.bag", "format": "bag", "topics": ["/number"], "begin": 0, "end": 2000}


class Browser:
    """One browser that has opened a bag of ten numbers."""

    def __init__(self, folder: Path, **settings: float) -> None:
        path = folder / "run.bag"
        path.write_bytes(bag_bytes([("/number", Float64(number), 1000 + number, 0) for number in range(10)]))
        self.system = WatchedSystem(GraphClient("test"), Node("test"))
        self.open_bags = OpenBags()
        self.views = BagViews(self.system, BagFolder(folder), self.open_bags, **settings)
        self._path = path
        self._showing = contextlib.ExitStack()

    def run(self, task: Callable[[], Awaitable[Any]]) -> None:
        """Run a coroutine in an event loop while the bag is open."""

        async def run() -> None:
            set_current_browser()
            with self._showing:
                self._showing.enter_context(self.open_bags.showing(self.playback()))
                await task()

        asyncio.run(run())

    def playback(self) -> BagPlayback:
        return BagPlayback(self.system, BagReader(self._path))

    def close_bag(self) -> None:
        self._showing.close()


@pytest.fixture
def browser(tmp_path: Path) -> Browser:
    return Browser(tmp_path)


async def whole(view: AsyncIterator[Any]) -> list[Any]:
    """Return everything that a view yields."""
    return [each async for each in view]


def test_a_further_export_waits_until_one_has_ended(browser: Browser) -> None:
    async def check() -> None:
        async with contextlib.AsyncExitStack() as stack:
            running = browser.views.bag_export(EXPORT)
            await stack.enter_async_context(contextlib.aclosing(running))  # type: ignore[type-var]
            assert isinstance(await anext(running), bytes)
            with pytest.raises(RequestRefused, match=r"try again when one has ended; the limit is 2"):
                await whole(browser.views.bag_export(EXPORT))
            assert await asyncio.create_task(of_another_browser()) == {"done": True}
            await whole(running)
            assert (await whole(browser.views.bag_export(EXPORT)))[-1] == {"done": True}

    async def of_another_browser() -> object:
        set_current_browser()
        with browser.open_bags.showing(browser.playback()):
            return (await whole(browser.views.bag_export(EXPORT)))[-1]

    browser.run(check)


class FullDisk(io.BytesIO):
    """A file on a full disk."""

    def write(self, _: Any) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_an_export_to_a_full_disk_is_refused(browser: Browser, monkeypatch: pytest.MonkeyPatch) -> None:
    async def check() -> None:
        for _ in range(PAGE_EXPORTS + 1):
            with pytest.raises(RequestRefused, match=r"cannot export: .*No space left on device"):
                await whole(browser.views.bag_export(EXPORT))

    monkeypatch.setattr(tempfile, "TemporaryFile", FullDisk)
    browser.run(check)


def test_views_that_wait_for_a_bag_to_close_do_not_exceed_the_limit_together(browser: Browser) -> None:
    released = threading.Event()

    async def check() -> None:
        limit = PAGE_BAGS
        opening = [browser.views.bag({"name": "run.bag"}) for _ in range(limit + 5)]
        tasks = [asyncio.ensure_future(anext(each)) for each in opening]
        await asyncio.sleep(0)  # each of them waits for the open bag
        browser.close_bag()
        results = await asyncio.gather(*tasks, return_exceptions=True)
        assert results.count({"opening": 0.0}) == limit
        refused = [str(each) for each in results if isinstance(each, RequestRefused)]
        assert len(refused) == 5
        assert all(f"too many bags are open; the limit is {limit}" in each for each in refused)
        for each in opening:
            await each.aclose()  # type: ignore[attr-defined]

    for _ in range(COMPUTATIONS_AT_ONCE):  # so that no bag is opened meanwhile
        browser.system.computations.start(released.wait)
    try:
        browser.run(check)
    finally:
        released.set()


def test_an_expression_that_takes_too_long_ends_the_curve_of_a_bag(tmp_path: Path) -> None:
    browser = Browser(tmp_path, computed_s=0.01)  # so that the expression is slow on any machine

    async def check() -> None:
        slow = "/number=len([1 for a in range(1000) for b in range(1000) for c in range(1000)])"
        with pytest.raises(RequestRefused, match=r"a sample takes .* s, and the limit is 0\.01 s"):
            await whole(browser.views.bag_curve({"name": "run.bag", "field": slow}))

    browser.run(check)


def test_a_bag_that_fails_to_open_after_its_view_was_closed_leaves_no_error(
    browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    problems: list[str] = []
    may_fail = threading.Event()
    futures: list[Future[Any]] = []
    start = browser.system.computations.start

    def fail(_: Path) -> Any:
        may_fail.wait(60)
        raise BagError("damaged")

    def recording_start(*arguments: Any) -> Future[Any]:
        futures.append(start(*arguments))
        return futures[-1]

    monkeypatch.setattr(bag_opening, "open_bag", fail)
    monkeypatch.setattr(browser.system.computations, "start", recording_start)

    async def check() -> None:
        set_current_browser()
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: problems.append(context["message"]))
        view = browser.views.bag({"name": "run.bag"})
        assert await anext(view) == {"opening": 0.0}
        await view.aclose()  # type: ignore[attr-defined]
        has_failed = asyncio.Event()  # set after the loop has passed the exception on
        loop.call_soon(futures[0].add_done_callback, lambda _: loop.call_soon_threadsafe(has_failed.set))
        loop.call_soon(may_fail.set)
        await has_failed.wait()
        futures.clear()
        for _ in range(COMPUTATIONS_AT_ONCE):  # so that no thread refers to its last computation
            await browser.system.computations.run(lambda: None)
        gc.collect()

    asyncio.run(check())
    assert problems == []


# Tracks of a timeline, from the indexes of bags.


@pytest.mark.parametrize("name", ["one.bag", "one.mcap"])
def test_a_single_chunk_has_a_visible_track(tmp_path: Path, name: str) -> None:
    kind = load_message_class("std_msgs/Float64")
    fields = {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
    with (tmp_path / name).open("wb") as file:
        writer = writer_for(name, file)
        number = writer.add_connection("/number", {key: text.encode() for key, text in fields.items()})
        for second in range(1000, 2000):
            writer.write(number, second, 0, struct.pack("<d", second))
        writer.finish()
    with open_bag(tmp_path / name) as bag:
        (track,) = tracks(bag)
    assert (track.topic, track.count, len(track.bins)) == ("/number", 1000, BINS)
    assert all(track.bins)


# The bags that browsers have opened, one per browser.


def in_a_browser() -> contextvars.Context:
    """Return a context that serves a new browser."""
    context = contextvars.copy_context()
    context.run(set_current_browser)
    return context


@pytest.fixture
def playback(tmp_path: Path) -> Iterator[BagPlayback]:
    with (tmp_path / "a.bag").open("wb") as file:
        writer = BagWriter(file)
        fields = {"topic": b"/a", "type": b"std_msgs/Empty", "md5sum": b"*", "message_definition": b""}
        writer.write(writer.add_connection("/a", fields), 1, 0, b"")
        writer.finish()
    system = WatchedSystem(GraphClient("test"), Node("test"))
    found = BagPlayback(system, BagReader(tmp_path / "a.bag"))
    yield found
    found.close()


def test_a_bag_belongs_to_the_browser_that_opened_it(playback: BagPlayback) -> None:
    bags, mine, other = OpenBags(), in_a_browser(), in_a_browser()
    with contextlib.ExitStack() as stack:
        mine.run(stack.enter_context, bags.showing(playback))
        assert mine.run(lambda: bags.playback) is playback
        assert other.run(lambda: bags.playback) is None
        assert other.run(bags.served_views, lambda _: ServedViews()) is None
        with pytest.raises(RequestRefused, match="already opened"):
            mine.run(stack.enter_context, bags.showing(playback))
        assert len(bags) == 1
    assert len(bags) == 0


def test_views_are_made_once_per_jump(playback: BagPlayback) -> None:
    bags, mine = OpenBags(), in_a_browser()
    made: list[WatchedSystem] = []

    def make(system: WatchedSystem) -> ServedViews:
        made.append(system)
        return ServedViews()

    with contextlib.ExitStack() as stack:
        mine.run(stack.enter_context, bags.showing(playback))
        assert mine.run(bags.served_views, make) is mine.run(bags.served_views, make)
        playback.jump(0)
        mine.run(bags.served_views, make)
    assert len(made) == 2


# Names of bags that a browser may open.


def test_bags_in_subfolders_are_listed_and_links_out_are_not(tmp_path: Path) -> None:
    inside, outside = tmp_path / "bags", tmp_path / "outside.bag"
    (inside / "day").mkdir(parents=True)
    for path in (outside, inside / "day" / "run.bag", inside / "open.bag.active", inside / "notes.txt"):
        path.write_bytes(b"12345")
    (inside / "link.bag").symlink_to(outside)
    (inside / "same.bag").symlink_to(inside / "day" / "run.bag")
    (inside / "up").symlink_to(tmp_path)
    (inside / "loop.bag").symlink_to("loop.bag")
    assert dict(BagFolder(inside).names()) == {"day/run.bag": 5, "open.bag.active": 5, "same.bag": 5}


def test_the_newest_bags_are_listed_whichever_folder_is_read_first(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(folder, "MAX_FILES", 1)
    for number in range(4):
        day = tmp_path / f"day{number}"
        day.mkdir()
        (day / "run.bag").write_bytes(b"1")
        os.utime(day / "run.bag", (0, 0))
    last_read = os.listdir(tmp_path)[-1]
    os.utime(tmp_path / last_read / "run.bag")
    assert [name for name, _ in BagFolder(tmp_path).names()] == [f"{last_read}/run.bag"]


@pytest.mark.parametrize(("name", "says"), [
    ("../outside.bag", "relative to its folder"), ("link.bag", "no file"), ("up/outside.bag", "no file"),
    ("/etc/passwd", "must end in"), ("/etc/x.bag", "relative to its folder"), ("missing.bag", "no file"),
    ("loop.bag", "no file"), ("l" * 300 + ".bag", "no file"), (7, "must end in"),
])  # fmt: skip
def test_names_that_lead_out_of_the_folder_are_refused(tmp_path: Path, name: object, says: str) -> None:
    inside = tmp_path / "bags"
    inside.mkdir()
    (tmp_path / "outside.bag").write_bytes(b"")
    (inside / "link.bag").symlink_to(tmp_path / "outside.bag")
    (inside / "up").symlink_to(tmp_path)
    (inside / "loop.bag").symlink_to("loop.bag")
    with pytest.raises(BadBagName, match=says):
        BagFolder(inside).find(name)


# Parts of bags that a browser saves.


SECOND = 10**9


@pytest.fixture
def numbers(tmp_path: Path) -> Path:
    """A bag with a number at each second from 1000 to 1099, and one text at 1000."""
    path = tmp_path / "numbers.bag"
    with path.open("wb") as file:
        bag = BagWriter(file, chunk_bytes=200)
        added = {}
        for topic, name in (("/number", "std_msgs/Float64"), ("/text", "std_msgs/String")):
            kind = load_message_class(name)
            fields = {"type": name, "md5sum": kind._md5sum, "message_definition": kind._full_text}
            header = {"topic": topic.encode(), **{key: value.encode() for key, value in fields.items()}}
            added[topic] = bag.add_connection(topic, header)
        bag.write(added["/text"], 1000, 0, b"\x00\x00\x00\x00")
        for second in range(100):
            bag.write(added["/number"], 1000 + second, 0, struct.pack("<d", second))
        bag.finish()
    return path


@pytest.mark.parametrize("form", FORMATS[:2])
def test_a_selection_above_the_limit_is_refused(numbers: Path, form: str) -> None:
    with BagReader(numbers) as bag, pytest.raises(BagError, match=r"limit is 100 .page_export_bytes"):
        export(bag, ["/number"], (0, 2000 * SECOND), form, BytesIO(), 100)


def test_the_newest_message_before_a_moment_is_found_far_back(numbers: Path) -> None:
    with BagReader(numbers) as bag:
        found = newest_before(bag, bag.connections_of("/text"), 1099 * SECOND)
        assert found.time_ns == 1000 * SECOND
        exact = newest_before(bag, bag.connections_of("/number"), 1007 * SECOND + 5)
        assert exact.time_ns == 1007 * SECOND
        assert newest_before(bag, bag.connections_of("/text"), 999 * SECOND) is None


@pytest.mark.parametrize("topic", ["/..", "/", "..\\..\\up", "/c:"])
def test_no_topic_of_a_bag_leaves_the_zip_file(tmp_path: Path, topic: str) -> None:
    kind = load_message_class("sensor_msgs/Image")
    fields = {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
    header = {key: value.encode() for key, value in fields.items()}
    image = kind(height=1, width=1, step=1, encoding="mono8", data=b"\x07")
    with (tmp_path / "images.bag").open("wb") as file:
        bag = BagWriter(file)
        added = bag.add_connection(topic, {"topic": topic.encode(), **header})
        bag.write(added, 1000, 0, b"".join(image._to_buffers()))
        bag.finish()
    for form in ("csv", "images"):
        part = BytesIO()
        with BagReader(tmp_path / "images.bag") as whole:
            export(whole, [topic], (0, 2000 * SECOND), form, part, 1000)
        with zipfile.ZipFile(part) as archive:
            (name,) = archive.namelist()
        assert re.fullmatch(r"\w+(/\d{6}_1000\.0{9})?\.\w+", name), name


def test_topics_that_would_have_one_name_in_the_zip_file_get_numbers(tmp_path: Path) -> None:
    message: Any = load_message_class("std_msgs/String")(data="x")
    topics = ["/a/b", "/a__b", "/A/b", "/" + "l" * 300]
    (tmp_path / "same.bag").write_bytes(bag_bytes([(topic, message, 1, 0) for topic in topics]))
    with BagReader(tmp_path / "same.bag") as bag, (tmp_path / "out.zip").open("w+b") as file:
        export(bag, topics, (0, 9 * 10**9), "csv", file, 1 << 20)
        names = zipfile.ZipFile(file).namelist()
    assert names == ["A__b.csv", "a__b_2.csv", "a__b_3.csv", "l" * 200 + ".csv"]


def test_an_exported_bag_begins_with_the_latched_messages(tmp_path: Path) -> None:
    path = tmp_path / "latched.bag"
    kind = load_message_class("std_msgs/String")
    fields = {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
    header = {key: value.encode() for key, value in fields.items()}
    with path.open("wb") as file:
        bag = BagWriter(file)
        for topic, latching in (("/map", b"1"), ("/tf_static", b"1"), ("/talk", b"0")):
            added = bag.add_connection(topic, {"topic": topic.encode(), "latching": latching, **header})
            for second, text in enumerate("abc"):
                bag.write(added, 1000 + second, 0, b"\x01\x00\x00\x00" + text.encode())
        bag.finish()
    part = BytesIO()
    with BagReader(path) as whole:
        topics = ["/map", "/talk", "/tf_static"]
        export(whole, topics, (1002 * SECOND, 1003 * SECOND), "bag", part, 1000)
    (tmp_path / "part.bag").write_bytes(part.getvalue())
    with BagReader(tmp_path / "part.bag") as cut:
        found = sorted((message.connection.topic, message.data[-1:]) for message in cut.stored_messages())
        assert cut.range_ns[0] == 1002 * SECOND
    assert found == [
        ("/map", b"b"), ("/map", b"c"), ("/talk", b"c"), ("/tf_static", b"a"), ("/tf_static", b"b"),
        ("/tf_static", b"c"),
    ]  # fmt: skip


@pytest.mark.parametrize("bad", [0, 1, 2])
def test_an_image_that_cannot_be_written_does_not_end_the_export(bad: int, tmp_path: Path) -> None:
    kind: Any = load_message_class("sensor_msgs/Image")
    good = kind(height=1, width=1, step=1, encoding="mono8", data=b"x")
    rows = [("/camera", kind() if number == bad else good, number, 0) for number in range(3)]
    (tmp_path / "images.bag").write_bytes(bag_bytes(rows))

    with BagReader(tmp_path / "images.bag") as bag, (tmp_path / "out.zip").open("w+b") as file:
        export(bag, ["/camera"], (0, 9 * 10**9), "images", file, 1 << 20)
    with zipfile.ZipFile(tmp_path / "out.zip") as archive:
        names = sorted(archive.namelist())
        reason = archive.read("left_out.txt").decode()

    seconds = [number for number in range(3) if number != bad]
    assert names == [f"camera/{n:06d}_{n}.000000000.png" for n in seconds] + ["left_out.txt"]
    assert f"messages on /camera are left out: the message received at {bad}.000000000: the image" in reason
