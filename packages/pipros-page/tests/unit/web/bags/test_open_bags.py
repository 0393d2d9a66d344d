"""The bags that browsers have opened, one per browser."""

import contextlib
import contextvars
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.node import Node
from pipros_page.bags import folder
from pipros_page.bags.folder import BadBagName, BagFolder
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


def test_the_newest_bags_are_listed_whichever_folder_is_read_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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
    ("../outside.bag", "is outside the bag folder"), ("link.bag", "is outside the bag folder"),
    ("up/outside.bag", "is outside the bag folder"), ("/etc/passwd", "must end in"),
    ("/etc/x.bag", "is outside the bag folder"), ("missing.bag", "there is no bag"),
    ("loop.bag", "there is no bag"), ("a\0.bag", "null character"), (7, "must end in"),
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
