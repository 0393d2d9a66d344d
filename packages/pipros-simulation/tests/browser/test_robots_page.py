"""The page of pipros_sim in a browser: drag and drop, arrow keys, and the buttons."""

from __future__ import annotations

import json

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def pose_on(tab: Tab) -> list[float]:
    """Return x, y and yaw of the only robot; an empty list before it exists."""
    robots = json.loads(tab.locator("canvas").get_attribute("data-robots") or "[]")
    return list(robots[0][1:]) if robots else []


def drag(tab: Tab, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag from one position in the world to another, in metres."""
    box = tab.locator("canvas").bounding_box()
    assert box is not None
    places = [
        (box["x"] + (x + 5) / 10 * box["width"], box["y"] + (4 - y) / 8 * box["height"])
        for x, y in (start, end)
    ]
    tab.mouse.move(*places[0])
    tab.mouse.down()
    tab.mouse.move(*places[1])
    tab.mouse.up()


def test_a_robot_is_dragged_turned_steered_and_reset(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    sim = ros.pipros.start("rosrun", "pipros_sim", "sim")
    tab = open_tab(Page.of(sim), "")
    expect(tab).to_have_title("Robots /sim")
    wait_until(lambda: pose_on(tab) == [0, 0, 0], 30, "the robot")

    drag(tab, (0, 0), (2, -1))
    wait_until(lambda: pose_on(tab) == pytest.approx([2, -1, 0], abs=0.05), 30, lambda: str(pose_on(tab)))
    tab.keyboard.down("Shift")
    drag(tab, (2, -1), (2, 2))
    tab.keyboard.up("Shift")
    wait_until(lambda: pose_on(tab) == pytest.approx([2, -1, 1.57], abs=0.1), 30, lambda: str(pose_on(tab)))
    drag(tab, (2, -1), (-5, 0))
    expect(tab.locator("#system")).to_contain_text("a wall or the map's edge is too close")
    keep_screenshots(tab, "robots")
    expect(tab.get_by_label("Robot to steer")).to_be_visible()
    tab.locator("canvas").press("ArrowUp")
    wait_until(lambda: pose_on(tab)[1] > -0.9, 30, lambda: str(pose_on(tab)))
    tab.get_by_role("button", name="Reset robots").click()
    wait_until(lambda: pose_on(tab) == [0, 0, 0], 30, lambda: str(pose_on(tab)))
    tab.get_by_role("button", name="Close simulation").click()
    expect(tab.locator("#system")).to_have_text("the simulation has ended")
    assert sim.wait() == 0
