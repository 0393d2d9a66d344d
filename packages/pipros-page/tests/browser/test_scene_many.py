"""Many markers and large clouds in the Scene tab."""

import sys
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.browser.test_scene_tab import drag, scene_of, wait_for_colours
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
def test_small_solids_look_like_large_ones(
    system: RosSystem, open_tab: OpenTab, tmp_path: Path, kind: str
) -> None:
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


def test_a_display_that_makes_pictures_slow_is_named(
    system: RosSystem, open_tab: OpenTab, tmp_path: Path
) -> None:
    slow = "{Class: rviz/PointCloud2, Name: Boxes, Topic: /large, Style: Boxes, Size (m): 0.3}"
    tab = scene_of(system, open_tab, tmp_path, f"{{Class: rviz/Grid, Name: Grid}}, {slow}")
    tab.wait_for_function("() => document.querySelector('.tab-scene')?.scene?.displays.length === 2")
    evaluate(tab, "const { draw } = scene; scene.draw = () => { draw.call(scene); scene.invalidate(); };")
    line = tab.locator(".scene-slow")
    expect(line).to_contain_text("slow: Boxes (100,000 points) takes", timeout=120_000)
    keep_screenshots(tab, "slow-display")
    evaluate(tab, "scene.displays[1].turnOff();")
    expect(line).to_have_text("", timeout=120_000)
