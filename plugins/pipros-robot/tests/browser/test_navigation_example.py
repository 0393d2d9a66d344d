"""The robot in examples/navigation drives to goals set in the scene, on desktops and phones."""

from typing import Any

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots, press, show_all_controls
from tests.support.environments import REPOSITORY
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

EXAMPLE = REPOSITORY / "examples" / "navigation"
SIZES = {"desktop": (1200, 800), "phone": (390, 844)}
STATE = """() => {
  const scene = document.querySelector(".tab-scene")?.scene;
  if (!scene?.view) return {};
  const levels = Object.fromEntries(scene.all().map((each) => [each.name, each.level]));
  const plan = scene.all().find((each) => each.name === "Plan");
  let robot = null;
  try { robot = scene.poseOf("base_link", 0n).slice(0, 2); } catch { /* not yet */ }
  return { levels, robot, plans: plan.received };
}"""


def state_of(tab: Tab) -> dict[str, Any]:
    found: dict[str, Any] = tab.evaluate(STATE)
    return found


@pytest.mark.parametrize("kind", SIZES)
def test_a_goal_is_reached(ros: RosSystem, open_tab: OpenTab, kind: str) -> None:
    path = f"{EXAMPLE}:{ros.pipros.environment.get('ROS_PACKAGE_PATH', '')}"
    ros.pipros.start(
        "roslaunch", "navigation_example", "navigation.launch", "rviz:=false", ROS_PACKAGE_PATH=path
    )
    ros.wait_for_publisher("/scan")
    page = Page(ros, "-d", EXAMPLE / "navigation.rviz", "--control", command="rviz")
    tab = open_tab(page, "scene", SIZES[kind])
    wait_until(
        lambda: all(state_of(tab).get("levels", {}).get(name) == "ok" for name in ("Map", "Scan", "Robot")),
        60.0,
        what=lambda: str(state_of(tab)),
    )
    begin = state_of(tab)["robot"]
    press(tab, "2D Nav Goal")
    box = tab.locator(".scene-canvas").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2 + 60, box["y"] + box["height"] / 2  # 1 m to the right of the robot
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 60, y)
    tab.mouse.up()
    wait_until(lambda: state_of(tab)["plans"] == 1, 60.0)
    wait_until(
        lambda: state_of(tab)["robot"] == pytest.approx([begin[0] + 1, begin[1]], abs=0.2),
        60.0,
        what=lambda: str([begin, state_of(tab)]),
    )
    keep_screenshots(tab, f"navigation-{kind}")


def test_without_control_no_goal_can_be_set(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    tab = open_tab(Page(ros, "-d", EXAMPLE / "navigation.rviz", command="rviz"), "scene", SIZES["phone"])
    show_all_controls(tab)
    expect(tab.get_by_role("button", name="2D Nav Goal")).to_be_disabled()
    keep_screenshots(tab, "navigation-read-only")
