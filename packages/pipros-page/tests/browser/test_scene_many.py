"""Many markers and large clouds in the Scene tab."""

import sys
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from pipros.msg import load_message_class
from pipros_tools.bag import BagWriter
from tests.browser.chromium import OpenTab, keep_screenshots
from tests.browser.test_bags_tab import BEGIN, connect, jump_to, show_tab
from tests.browser.test_scene_tab import drag, scene_of, wait_for_colours
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "many_program.py"
MARKERS = "{Class: rviz/MarkerArray, Name: Markers, Marker Topic: /many}"
GREY, RED, GREEN = (48, 48, 48), (255, 0, 0), (0, 255, 0)


@pytest.fixture
def system(ros: RosSystem) -> RosSystem:
    ros.serve_master()
    ros.pipros.start(sys.executable, PROGRAM)
    ros.wait_for_publisher("/large")
    return ros


def evaluate(tab: Tab, script: str) -> Any:
    return tab.evaluate(f"() => {{ const {{ scene }} = document.querySelector('.tab-scene'); {script} }}")


def test_thousands_of_markers_are_a_few_objects(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = scene_of(system, open_tab, tmp_path, MARKERS)
    # Markers 0 to 2 are a cube, a sphere and a cylinder; only the large cube has the finest detail.
    # The shade of a sphere varies, because the height of the canvas moves its centre by half a pixel.
    places = {(-4, -5): GREEN, (-3.8, -5): GREEN, (-3.6, -5): GREEN, (-3.9, -5): GREY, (-6.4, 0.4): RED}
    wait_for_colours(tab, places, tolerance=16)
    calls = evaluate(tab, "scene.draw(); return scene.renderer.info.render.calls;")
    assert calls <= 9, calls  # the levels of detail of three types
    keep_screenshots(tab, "many-markers")
    tab.locator(".scene-canvas").focus()
    tab.keyboard.press("s")
    panel = tab.get_by_role("region", name="Selection")
    drag(tab, (-3.85, -4.95), (-3.75, -5.05))
    expect(panel).to_contain_text("Markers: Marker spheres/1")
    drag(tab, (-6.4, 0.4), (-6.3, 0.3))
    expect(panel).to_contain_text("Markers: Marker cubes/1998")
    expect(panel).to_contain_text("Position-6; 0; 0")
    evaluate(tab, "scene.displays[0].switchPart('spheres', false);")
    wait_for_colours(tab, {**places, (-3.8, -5): GREY}, tolerance=16)
    # In one call, because the markers are published again and again.
    clear = "const [one] = scene.displays; one.take({ action: 3, ns: '', id: 0 });"
    assert evaluate(tab, f"{clear} return [one.shown.size, one.root.children.length];") == [0, 0]


COVERED = """([isFinest, view]) => {
  const { scene } = document.querySelector(".tab-scene");
  const [display] = scene.displays;
  scene.setView(view);
  display.detail = (camera, height) => {
    for (const batch of display.batches.all.values()) batch.arrange(camera, height, 1, isFinest);
  };
  scene.draw();
  const { width, height } = scene.canvas;
  const pixels = new Uint8Array(width * height * 4);
  const gl = scene.renderer.getContext();
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const found = { covered: [], green: 0 };
  for (let at = 0; at < pixels.length; at += 4) {
    const isCovered = pixels[at] !== 48 || pixels[at + 1] !== 48;
    found.covered.push(isCovered);
    if (isCovered) found.green += pixels[at + 1] - 48;
  }
  return found;
}"""


@pytest.mark.parametrize("kind", ["rviz/Orbit", "rviz/TopDownOrtho"])
def test_small_solids_look_like_large_ones(system: RosSystem, open_tab: OpenTab, tmp_path, kind: str) -> None:
    tab = scene_of(system, open_tab, tmp_path, MARKERS)
    wait_for_colours(tab, {(-4, -5): GREEN, (-6.4, 0.4): RED}, tolerance=8)
    view = {
        "Class": kind, "Name": "Current View", "Distance": "25", "Pitch": "0.6", "Yaw": "0.9", "Scale": "40",
    }  # fmt: skip
    fine, small = (tab.evaluate(COVERED, [is_finest, view]) for is_finest in (True, False))
    both = sum(one and other for one, other in zip(fine["covered"], small["covered"], strict=True))
    either = sum(one or other for one, other in zip(fine["covered"], small["covered"], strict=True))
    assert both > 0.7 * either > 1000  # only the edges of large ones are smoothed
    assert small["green"] == pytest.approx(fine["green"], rel=0.1)


def test_a_large_cloud_is_decoded_in_a_worker(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    cloud = "{Class: rviz/PointCloud2, Name: Cloud, Topic: /large, Style: Points, Size (Pixels): 3}"
    tab = scene_of(system, open_tab, tmp_path, cloud)
    wait_for_colours(tab, {(-2, 2): (255, 0, 0), (2, -2): (255, 0, 255), (-4.5, 0): GREY}, tolerance=1)
    before = evaluate(tab, "return scene.displays[0].received;")
    wait_until(lambda: evaluate(tab, "return scene.displays[0].received;") > before + 2, 60.0, "clouds")
    assert len(tab.workers) == 1
    objects = "scene.draw(); return scene.renderer.info.memory.geometries;"
    assert evaluate(tab, objects) == 1  # the buffers are used again
    evaluate(tab, "scene.displays[0].turnOff();")
    wait_until(lambda: evaluate(tab, "return true;") and not tab.workers, 30.0, "the end of the worker")
    assert evaluate(tab, objects) == 0


def test_a_display_that_makes_pictures_slow_is_named(system: RosSystem, open_tab: OpenTab, tmp_path) -> None:
    slow = "{Class: rviz/PointCloud2, Name: Boxes, Topic: /large, Style: Boxes, Size (m): 0.3}"
    tab = scene_of(system, open_tab, tmp_path, f"{{Class: rviz/Grid, Name: Grid}}, {slow}")
    tab.wait_for_function("() => document.querySelector('.tab-scene')?.scene?.displays.length === 2")
    evaluate(tab, "const { draw } = scene; scene.draw = () => { draw.call(scene); scene.invalidate(); };")
    line = tab.locator(".scene-slow")
    expect(line).to_contain_text("slow: Boxes (100,000 points) takes", timeout=120_000)
    keep_screenshots(tab, "slow-display")
    evaluate(tab, "scene.displays[1].turnOff();")
    expect(line).to_have_text("", timeout=120_000)


# The Scene tab shows one moment of a bag, without remains of other moments.


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


def test_the_scene_follows_a_bag_without_stale_objects(ros: RosSystem, open_tab: OpenTab, tmp_path) -> None:
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
