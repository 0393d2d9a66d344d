"""Interactive markers send the feedback of genuine rviz: `script/generate rviz controls` recorded it."""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page as Tab

from tests.browser.chromium import OpenTab
from tests.support.environments import file_of_tests
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.rviz_records import GRIPS, Grip, controls_file, feedback_by_marker
from tests.support.rviz_scenes import HEIGHT, WIDTH
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "controls_program.py"
GOLDEN = file_of_tests("golden/rviz_controls.json")
TOLERANCES = {"position": 0.04, "mouse_point": 0.04, "orientation": 0.02}
"""Two pixels in metres, which also is how exactly rviz finds a point; one pixel at the rim of a disc."""

RESIZE = """([width, height]) => {
  const scene = document.querySelector(".tab-scene")?.scene;
  if (!scene?.displays?.[0]?.entries?.size) return 0;
  Object.assign(scene.canvas.style, { width: `${width}px`, height: `${height}px` });
  scene.draw();
  return [...scene.displays[0].entries.values()].filter(({ isLost }) => !isLost).length;
}"""


def drag(tab: Tab, grip: Grip) -> None:
    box = tab.locator(".scene-canvas").bounding_box()
    assert box is not None
    (x, y), end = grip.pixels()
    left, top = box["x"], box["y"]
    button: Any = "right" if grip.button == 3 else "left"
    tab.mouse.move(left + x - 3, top + y)
    tab.mouse.move(left + x, top + y)
    if grip.key:
        tab.keyboard.down(grip.key)
    tab.mouse.down(button=button)
    if end != (x, y):
        tab.mouse.move(left + end[0], top + end[1])
    tab.mouse.up(button=button)
    if grip.key:
        tab.keyboard.up(grip.key)
    if grip.menu_entry:
        tab.get_by_role("menuitem", name=grip.menu_entry).click()


def differences(
    found: Sequence[Mapping[str, Any]], expected: Sequence[Mapping[str, Any]]
) -> Sequence[tuple[int, str, Any, Any]]:
    """Return the number, the field and the values of each difference."""
    events = [[each["event_type"] for each in events] for events in (found, expected)]
    if events[0] != events[1]:
        return [(0, "event_type", *events)]
    unlike = []
    for number, (one, other) in enumerate(zip(found, expected, strict=True)):
        for name, value in other.items():
            about = pytest.approx(value, abs=TOLERANCES[name]) if name in TOLERANCES else value
            if one[name] != about:
                unlike.append((number, name, one[name], value))
    return unlike


def test_feedback_is_that_of_rviz_field_by_field(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    ros.serve_master()
    program = ros.pipros.start(sys.executable, PROGRAM)
    ros.wait_for_publisher("/controls/update_full")
    file = tmp_path / "scene.rviz"
    file.write_text(controls_file())
    tab = open_tab(Page(ros, "-d", file, "--control", command="rviz"), "scene", (1200, 900))
    wait_until(lambda: tab.evaluate(RESIZE, [WIDTH, HEIGHT]) == len(GRIPS), 60.0, "the markers")
    ros.wait_for_links("/controls/feedback")
    golden: Mapping[str, Any] = json.loads(GOLDEN.read_text())
    found: dict[str, Any] = {}
    for grip in GRIPS:
        drag(tab, grip)

    def is_complete() -> bool:
        found.update(feedback_by_marker([json.loads(line) for line in program.stdout if line[0] == "{"]))
        return {name: len(events) for name, events in found.items()} == {
            name: len(events) for name, events in golden.items()
        }

    try:
        wait_until(is_complete, 60.0)
    except AssertionError:
        is_complete()
    assert {
        name: unlike for name in golden if (unlike := differences(found.get(name, []), golden[name]))
    } == {}
