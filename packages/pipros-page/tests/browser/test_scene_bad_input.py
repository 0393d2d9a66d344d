"""Bad messages, transforms and meshes are reported by their displays, and do not affect other displays."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pytest
from playwright.sync_api import Browser
from playwright.sync_api import Page as Tab

from tests.browser.test_scene_tab import ROBOT, VIEW, system, wait_for_colours  # noqa: F401 # a fixture
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "bad_scene_program.py"
DISPLAYS = {
    "Path": "path", "Pose": "pose", "PoseArray": "poses", "Odometry": "odom",
    "PoseWithCovariance": "covariance", "Polygon": "polygon", "PointStamped": "point", "GridCells": "cells",
    "Range": "range", "WrenchStamped": "wrench", "PointCloud2": "cloud",
}  # fmt: skip
URIS = 6
MORE = (
    "{Class: rviz/Pose, Name: Zero, Topic: /bad/zero}",
    "{Class: rviz_imu_plugin/Imu, Name: Imu, Topic: /bad/imu}",
    "{Class: rviz/Map, Name: Empty, Topic: /bad/empty_map}",
    "{Class: rviz/Map, Name: Huge, Topic: /bad/huge_map}",
    "{Class: rviz/PointStamped, Name: Lost, Topic: /bad/lost}",
    "{Class: rviz/PointStamped, Name: Far, Topic: /bad/far, Radius: 1e300}",
    "{Class: rviz/Axes, Name: Loop, Reference Frame: two}",
    "{Class: rviz/MarkerArray, Name: Meshes, Marker Topic: /bad/meshes}",
    "{Class: rviz/Camera, Name: Camera, Image Topic: /bad/image}",
    "{Class: rviz/InteractiveMarkers, Name: Controls, Update Topic: /bad/controls/update}",
    "{Class: rviz/RobotModel, Name: Bad robot, Robot Description: bad_robot}",
    "{Class: rviz/TF, Name: Frames, Filter (whitelist): '('}",
)
PROBLEMS = """() => {
  const scene = document.querySelector(".tab-scene")?.scene;
  return Object.fromEntries(scene?.all?.().map((display) => [display.name, [...display.statuses]
    .filter(([, { level }]) => level !== "ok").map(([name, { text }]) => `${name}: ${text}`)]) ?? []);
}"""

UNUSABLE = """() => {
  const found = [];
  const isUsable = (value) => Number.isFinite(Math.fround(value));
  for (const { name, root } of document.querySelector(".tab-scene").scene.all())
    root.traverseVisible(({ matrixWorld }) => matrixWorld.elements.every(isUsable) || found.push(name));
  return found;
}"""
"""Displays with numbers that are no 32-bit floats, with which graphics cards cannot compute."""

INVALID = "Topic: Message contained invalid floating point values (nans or infs)"
EXPECTED = {
    **dict.fromkeys(("Path", "Pose", "PoseArray", "Odometry", "PoseWithCovariance", "Polygon"), INVALID),
    **dict.fromkeys(("PointStamped", "GridCells", "Range", "WrenchStamped", "Imu"), INVALID),
    "Zero": "Message: Uninitialized quaternion, assuming identity.",
    "PointCloud2": "Message: Data size (0 bytes) does not match width (4000000000) times height (4000000000) "
    "times point_step (16).  Dropping message.",
    "Empty": "Map: Map is zero-sized (0x0)",
    "Huge": "Map: Data size doesn't match width*height: width = 4000000000, height = 4000000000, "
    "data size = 0",
    "Lost": "Transform [sender=/bad_scene_program]: For frame [nowhere]: Frame [nowhere] does not exist",
    "Loop": "Link: The tf tree is invalid because it contains a loop.",
    "Camera": "Camera Info: Contains invalid floating point values (nans or infs)",
    "Controls": "bad: Marker contains invalid floating point values (nans or infs)",
    "Frames": "Filter (whitelist): ( is not a regular expression",
}
MESHES = {
    "many.stl": "an STL file of 84 bytes cannot have 4294967295 triangles",
    **dict.fromkeys(("cut.stl", "open.stl"), "it is an ASCII STL file without a complete solid"),
    "spaces.dae": "it is not a COLLADA file",
    "bomb.dae": "it is not a COLLADA file",
    "tree.dae": "its nodes repeat others more than 100000 times, or themselves",
    "ring.dae": "its nodes repeat others more than 100000 times, or themselves",
    "text.dae": "it is not a COLLADA file",
    "holes.obj": "it contains invalid floating point values (nans or infs)",
}
LONGEST = 1100


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Tab]:
    """A page whose exceptions fail the test. The loaders of meshes may print errors in its console."""
    errors: list[str] = []
    context = chromium.new_context(viewport={"width": 1200, "height": 900})
    made = context.new_page()
    made.on("pageerror", lambda error: errors.append(str(error)))
    yield made
    context.close()
    assert errors == []


def test_everything_bad_has_a_status_and_harms_no_other_display(
    system: RosSystem,  # noqa: F811
    tab: Tab,
    tmp_path: Path,
) -> None:
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    system.pipros.start(sys.executable, PROGRAM, meshes)
    system.wait_for_publisher("/bad/controls/update_full")
    shown = [f"{{Class: rviz/{kind}, Name: {kind}, Topic: /bad/{topic}}}" for kind, topic in DISPLAYS.items()]
    file = tmp_path / "scene.rviz"
    file.write_text(VIEW.format(displays=", ".join([*shown, *MORE, ROBOT])))
    tab.goto(Page(system, "-d", file, command="rviz").url)
    missing: list[str] = []

    def is_complete() -> bool:
        found: Mapping[str, Sequence[str]] = tab.evaluate(PROBLEMS)
        texts = found.get("Meshes", []), found.get("Bad robot", [])
        missing[:] = [f"{name}: {text}" for name, text in EXPECTED.items() if text not in found.get(name, [])]
        for number in range(URIS):
            if not any(each.startswith(f"mesh/{number}: Could not load") for each in texts[0]):
                missing.append(f"marker {number}")
        for name, text in MESHES.items():
            if not any(each.startswith(f"Link {name}: ") and each.endswith(text) for each in texts[1]):
                missing.append(f"{name}: {texts[1]}")
        assert all(len(each) < LONGEST for each in texts[0])
        return not missing

    wait_until(is_complete, 60.0, what=lambda: str(missing))
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    assert tab.evaluate(UNUSABLE) == []
    level, text = tab.evaluate("document.querySelector('.tab-scene').scene.fixedFrameStatus()")
    assert (level, text.partition(" sent by ")[2]) in {
        ("warning", f"[/bad_scene_program] is ignored: {reason}")
        for reason in (
            "its quaternion does not have the length 1",
            "it contains invalid floating point values (nans or infs)",
        )
    }
    # as if so many markers with different IDs already existed
    full = tab.evaluate(
        """() => {
          const { scene } = document.querySelector(".tab-scene");
          const display = scene.all().find(({ name }) => name === "Meshes");
          const [[, entry]] = display.shown;
          const other = { ...entry, isPlaced: true, until: null };
          for (let id = 0; id < 20000; id += 1) display.shown.set(`more/${id}`, other);
          const marker = { ...entry.message, ns: "one", id: 7, type: 1 };
          display.take(marker);
          const { text } = display.statuses.get("Markers");
          display.take({ ...marker, action: 3 });
          return [text, display.shown.size];
        }"""
    )
    assert full == ["At most 20000 markers are shown.", 0]
