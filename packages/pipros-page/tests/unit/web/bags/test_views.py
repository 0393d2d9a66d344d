"""Views of the Bags tab, without a server."""

import asyncio
import contextlib
import errno
import gc
import io
import os
import struct
import tempfile
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Float64

from pipros.msg import load_message_class
from pipros.node import Node
from pipros_page.bags import opening as bag_opening
from pipros_page.bags.folder import BagFolder
from pipros_page.bags.open_bags import OpenBags
from pipros_page.bags.playback import BagPlayback
from pipros_page.bags.tracks import BINS, tracks
from pipros_page.views.bags import PAGE_BAGS, PAGE_EXPORTS, BagViews
from pipros_page.watched_system import COMPUTATIONS_AT_ONCE, WatchedSystem
from pipros_server.browser_share import set_current_browser
from pipros_server.view_server import RequestRefused
from pipros_tools.bag import BagReader
from pipros_tools.bag.errors import BagError
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
