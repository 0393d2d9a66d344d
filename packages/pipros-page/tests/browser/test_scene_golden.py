"""The Scene tab draws and says what genuine rviz did: `script/generate rviz` recorded tests.golden."""

import base64
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page as Tab

from pipros_page.scene.layout_file import read_rviz
from tests.browser.chromium import OpenTab
from tests.support.environments import file_of_tests
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.rviz_records import PANELS, Statuses, comparable, display_of, panel_file, statuses_file
from tests.support.rviz_scenes import (
    COLOURED,
    FINE,
    FULL_COLOUR,
    HEIGHT,
    LEVELS,
    ODD_SCENES,
    ORTHO,
    OVERLAPS,
    TEMPLATE,
    USUAL_LEVELS,
    USUAL_OVERLAP,
    USUAL_SCENES,
    WIDTH,
    config_of,
    odd,
    overlap,
    unpacked,
)
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "scene_program.py"
ODD_PROGRAM = PROGRAM.with_name("odd_scene_program.py")
BAD_PROGRAM = PROGRAM.with_name("bad_scene_program.py")
GOLDEN = file_of_tests("golden/rviz")
PANEL_LEVELS = 2
UNLIKE = 0.02
"""Share of probes that may differ: Ogre lights the vertices of coarse meshes, and three.js pixels."""

SHOW = """(config) => {
  const { scene } = document.querySelector(".tab-scene");
  scene.load(config, "", false);
}"""
READ = """([places, size, fullColour]) => {
  const scene = document.querySelector(".tab-scene")?.scene;
  if (!scene?.view) return null;
  Object.assign(scene.canvas.style, { width: `${size[0]}px`, height: `${size[1]}px` });
  scene.draw();
  const { width, height } = scene.canvas;
  const pixels = new Uint8Array(width * height * 4);
  const gl = scene.renderer.getContext();
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const at = (x, y) => ((height - 1 - y) * width + x) * 4;
  const bits = new Uint8Array((width * height + 7) >> 3);
  for (let y = 0; y < height; y += 1) for (let x = 0; x < width; x += 1) {
    const from = at(x, y);
    const number = y * width + x;
    const colour = pixels.subarray(from, from + 3);
    const isEmpty = fullColour ? Math.max(...colour) - Math.min(...colour) < fullColour
      : colour.every((channel) => channel === 48);
    if (!isEmpty) bits[number >> 3] |= 1 << (number & 7);
  }
  let text = "";
  for (const byte of bits) text += String.fromCharCode(byte);
  const colours = places.map(([x, y]) => [...pixels.slice(at(x, y), at(x, y) + 3)]);
  const difference = pixels.reduce((sum, value, i) => (i % 4 === 3 ? sum : sum + Math.abs(value - 48)), 0);
  return { colours, silhouette: btoa(text), mean: difference / (3 * width * height) };
}"""

READ_PANEL = """([kind, places]) => {
  const { scene } = document.querySelector(".tab-scene");
  const drawing = scene.all().find(({ config }) => config.Name === kind)?.canvas?.getContext("2d");
  return drawing ? places.map(([x, y]) => [...drawing.getImageData(x, y, 1, 1).data].slice(0, 3)) : [];
}"""
READ_STATUSES = """() => {
  const displays = document.querySelector(".tab-scene")?.scene?.all() ?? [];
  const own = ({ statuses }) => [...statuses].map(([name, { level, text }]) => [name, [level, text]]);
  return Object.fromEntries(displays.map((display) => [display.name, Object.fromEntries(own(display))]));
}"""


def differences(tab: Tab, name: str) -> str:
    """Return a description of the difference from the recorded picture; empty if there is none."""
    golden: Mapping[str, Any] = json.loads((GOLDEN / f"{name}.json").read_text())
    places = [[int(part) for part in place.split(",")] for place in golden["probes"]]
    found = tab.evaluate(READ, [places, [WIDTH, HEIGHT], FULL_COLOUR if name in COLOURED else 0])
    if found is None:
        return "no picture yet"
    if name in FINE:
        wanted = golden["mean"]
        is_alike = wanted / 1.5 < found["mean"] < wanted * 1.5
        return "" if is_alike else f"mean difference {found['mean']:.4f}, not {wanted:.4f}"
    most = LEVELS.get(name, USUAL_LEVELS)
    unlike = [
        f"{place}: {actual}, not {expected}"
        for place, actual, expected in zip(places, found["colours"], golden["probes"].values(), strict=True)
        if any(abs(one - other) > most for one, other in zip(actual, expected, strict=True))
    ]
    share = len(unlike) / max(1, len(places))
    common = overlap(base64.b64decode(found["silhouette"]), unpacked(golden["silhouette"]))
    if share <= UNLIKE and common >= OVERLAPS.get(name, USUAL_OVERLAP):
        return ""
    return f"overlap {common:.4f}; {len(unlike)} of {len(places)} probes: {'; '.join(unlike[:8])}"


@pytest.mark.parametrize("scenes", [USUAL_SCENES, ODD_SCENES], ids=["usual", "odd"])
def test_all_scenes_look_as_in_rviz(ros: RosSystem, open_tab, tmp_path, scenes: Mapping[str, Any]) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, PROGRAM)
    ros.wait_for_publisher("/shapes")
    if scenes is ODD_SCENES:
        ros.pipros.start(sys.executable, ODD_PROGRAM, tmp_path)
        ros.wait_for_publisher("/odd/fine_cloud")
    tab = open_tab(Page(ros, command="rviz"), "scene", (1200, 900))
    wait_until(lambda: tab.evaluate("Boolean(document.querySelector('.tab-scene')?.scene?.view)"), 60.0)
    unlike = {}
    for name in scenes:
        tab.evaluate(SHOW, read_rviz(config_of(name)))
        try:
            wait_until(lambda name=name: not differences(tab, name), 60.0)  # type: ignore[misc]
        except AssertionError:
            unlike[name] = differences(tab, name)
    assert unlike == {}


def test_finite_parts_of_lists_are_drawn(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    """Genuine rviz has drawn no picture at all of these markers; of strips, it draws the finite parts."""
    ros.serve_master()
    ros.pipros.start(sys.executable, ODD_PROGRAM, tmp_path)
    ros.wait_for_publisher("/odd/fine_cloud")
    tab = open_tab(Page(ros, command="rviz"), "scene", (1200, 900))
    wait_until(lambda: tab.evaluate("Boolean(document.querySelector('.tab-scene')?.scene?.view)"), 60.0)

    def dark(places: list[tuple[int, int]]) -> list[tuple[int, int]]:
        found = tab.evaluate(READ, [places, [WIDTH, HEIGHT], 0])
        return [place for place, colour in zip(places, found["colours"], strict=True) if max(colour) < 150]

    inside = {
        "line_numbers": [(59, 79), (59, 109)],
        "point_numbers": [(84 + 85 * column, y) for column in range(3) for y in (79, 159)],
        "triangle_numbers": [(69, 64), (49, 124)],
    }
    for name, places in inside.items():
        tab.evaluate(SHOW, read_rviz(TEMPLATE.format(displays=odd(name), view=ORTHO)))
        wait_until(
            lambda places=places: not dark(places),  # type: ignore[misc]
            60.0,
            what=lambda name=name, places=places: f"{name}: {dark(places)}",  # type: ignore[misc]
        )


def panel_differences(tab: Tab, name: str, golden: Mapping[str, Any]) -> str:
    """Return how the picture of a panel differs from the recorded one; empty if it does not."""
    places = [[int(part) for part in place.split(",")] for place in golden]
    found = tab.evaluate(READ_PANEL, [display_of(name), places])
    unlike = [
        f"{place}: {actual}, not {expected}"
        for place, actual, expected in zip(places, found, golden.values(), strict=bool(found))
        if any(abs(one - other) > PANEL_LEVELS for one, other in zip(actual, expected, strict=True))
    ]
    return "; ".join(unlike[:8]) if found else "no picture yet"


def test_images_and_cameras_look_as_in_rviz(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, PROGRAM)
    ros.wait_for_publisher("/shapes")
    tab = open_tab(Page(ros, command="rviz"), "scene", (1200, 900))
    wait_until(lambda: tab.evaluate("Boolean(document.querySelector('.tab-scene')?.scene?.view)"), 60.0)
    recorded: Mapping[str, Mapping[str, Any]] = json.loads((GOLDEN.parent / "rviz_panels.json").read_text())
    assert list(recorded) == list(PANELS)
    for name, golden in recorded.items():
        tab.evaluate(SHOW, read_rviz(panel_file(name)))
        wait_until(
            lambda name=name, golden=golden: not panel_differences(tab, name, golden),  # type: ignore[misc]
            60.0,
            what=lambda name=name, golden=golden: f"{name}: {panel_differences(tab, name, golden)}",  # type: ignore[misc]
        )


def test_statuses_are_those_of_rviz(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, PROGRAM)
    ros.pipros.start(sys.executable, BAD_PROGRAM, tmp_path)
    for topic in ("/shapes", "/bad/controls/update_full"):
        ros.wait_for_publisher(topic)
    file = tmp_path / "scene.rviz"
    file.write_text(statuses_file())
    golden: Statuses = json.loads((GOLDEN.parent / "rviz_statuses.json").read_text())
    tab = open_tab(Page(ros, "-d", file, command="rviz"), "scene", (1200, 900))

    def unlike() -> list[str]:
        found: Statuses = tab.evaluate(READ_STATUSES)
        return [
            f"{display}: {name}: {actual}, not {expected}"
            for display, statuses in golden.items()
            for own in [comparable(found.get(display, {}))]
            for name, expected in comparable(statuses).items()
            if (actual := own.get(name)) != expected
        ]

    wait_until(lambda: not unlike(), 60.0, what=lambda: "\n".join(unlike()))
