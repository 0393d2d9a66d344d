"""The bags that browsers have opened, one per browser."""

from __future__ import annotations

import contextlib
import contextvars
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.node import Node
from pipros_page.bags.open_bags import OpenBags
from pipros_page.bags.playback import BagPlayback
from pipros_page.watched_system import WatchedSystem
from pipros_server.browser_share import set_current_browser
from pipros_server.view_server import RequestRefused, ServedViews
from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.graph.client import GraphClient


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
