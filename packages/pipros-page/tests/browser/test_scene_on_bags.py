"""The Scene tab shows one moment of a bag, without remains of other moments."""

from pathlib import Path
from typing import Any

from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from pipros.msg import load_message_class
from pipros_tools.bag import BagWriter
from tests.browser.chromium import OpenTab
from tests.browser.test_bags_tab import BEGIN, connect, jump_to, show_tab
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SECONDS = 20
SCENE = """\
Visualization Manager:
  Displays:
    - {Class: rviz/TF, Name: TF, Enabled: true}
    - {Class: rviz/Marker, Name: Marks, Enabled: true, Marker Topic: /marks}
    - {Class: rviz/Path, Name: Way, Enabled: true, Topic: /way}
    - {Class: rviz/Map, Name: Map, Enabled: true, Topic: /map}
  Global Options: {Fixed Frame: map}
"""
SHOWN = """() => {
  const scene = document.querySelector(".tab-scene")?.scene;
  if (!scene?.view || !scene.displays.length) return null;
  scene.draw();
  const [, marks, way, map] = scene.displays;
  const has = (display) => display.root.children.length > 0;
  const base = scene.frames.has("base") ? scene.frames.lookup("map", "base", 0n)[0] : null;
  return [Number(scene.now() / 1000000000n), base, [...marks.shown.keys()], has(way), has(map)];
}"""


def make_bag(path: Path) -> None:
    """Write 20 s: a base that moves 1 m/s, a marker from second 2 to 10, a path at 5, and a map at 8."""
    names = (
        "tf2_msgs/TFMessage", "geometry_msgs/TransformStamped", "visualization_msgs/Marker", "nav_msgs/Path",
        "nav_msgs/OccupancyGrid",
    )  # fmt: skip
    frames, transform, marker, way, grid = map(load_message_class, names)
    with path.open("wb") as file:
        bag = BagWriter(file, chunk_bytes=2000)
        tf, marks, ways, maps = (
            connect(bag, topic, name)
            for topic, name in (
                ("/tf", names[0]), ("/marks", names[2]), ("/way", names[3]), ("/map", names[4]),
            )
        )  # fmt: skip
        for tick in range(SECONDS * 10 + 1):
            second, tenth = divmod(tick, 10)
            stamp = BEGIN + second, tenth * 100_000_000
            link: Any = transform()
            link.header.stamp.secs, link.header.stamp.nsecs = stamp
            link.header.frame_id, link.child_frame_id, link.transform.rotation.w = "map", "base", 1.0
            link.transform.translation.x = tick / 10
            bag.write_message(tf, *stamp, frames([link]))
            if tenth:
                continue
            made: Any = {2: marker(action=0), 10: marker(action=2), 5: way(), 8: grid()}.get(second)
            if made is None:
                continue
            made.header.frame_id = "map"
            if second in {2, 10}:
                made.ns, made.type, made.pose.orientation.w, made.color.a = "box", 1, 1.0, 1.0
                made.scale.x = made.scale.y = made.scale.z = 1.0
            elif second == 8:
                made.info.width = made.info.height = 1
                made.info.resolution, made.info.origin.orientation.w, made.data = 1.0, 1.0, [0]
            bag.write_message({2: marks, 10: marks, 5: ways, 8: maps}[second], *stamp, made)
        bag.finish()


def wait_for(tab: Tab, expected: list[Any]) -> None:
    wait_until(lambda: tab.evaluate(SHOWN) == expected, 60.0, what=lambda: str(tab.evaluate(SHOWN)))


def test_the_scene_follows_a_bag_without_stale_objects(
    ros: RosSystem, open_tab: OpenTab, tmp_path: Path
) -> None:
    ros.serve_master()
    make_bag(tmp_path / "run.bag")
    (tmp_path / "scene.rviz").write_text(SCENE)
    page = Page(ros, "-d", tmp_path / "scene.rviz", "--bags", tmp_path, command="rviz")
    tab = open_tab(page, "bags/run.bag")
    for second, shown in ((9, [["box/0"], True, True]), (3, [["box/0"], False, False])):
        show_tab(tab, "Bags")
        jump_to(tab, str(second))
        show_tab(tab, "Scene")
        wait_for(tab, [BEGIN + second, second, *shown])
    # the beginning of the next loop does not show messages from the end
    show_tab(tab, "Bags")
    jump_to(tab, "19")
    show_tab(tab, "Scene")
    wait_for(tab, [BEGIN + 19, 19, [], True, True])
    show_tab(tab, "Bags")
    tab.get_by_label("Loop").check()
    tab.get_by_label("Speed", exact=True).select_option("0.25")  # four seconds until the marker appears
    show_tab(tab, "Scene")
    tab.get_by_role("button", name="Play the bag").click()
    shown: list[Any] = []

    def is_early() -> bool:
        shown[:] = tab.evaluate(SHOWN)
        return bool(shown[0] == BEGIN + 1)

    wait_until(is_early, 200.0, what=lambda: str(shown))
    assert shown[2:] == [[], False, False]
    show_tab(tab, "Bags")
    tab.get_by_role("button", name="Close the bag").click()
    expect(tab.locator("#shown-bag")).to_be_hidden()
    show_tab(tab, "Scene")
    wait_until(lambda: tab.evaluate(SHOWN)[0] > BEGIN + SECONDS, 30.0, "the time of the running system")
    assert tab.evaluate(SHOWN)[1:] == [None, [], False, False]
