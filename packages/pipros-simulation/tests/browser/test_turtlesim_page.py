"""The page of turtlesim in a browser: the canvas, the arrow keys, and the button that ends the node."""

from __future__ import annotations

import json

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def turtles_on(tab: Tab) -> list[list[object]]:
    return list(json.loads(tab.locator("canvas").get_attribute("data-turtles") or "[]"))


def pixel(tab: Tab, x: int, y: int) -> list[int]:
    script = (
        "([x, y]) => [...document.getElementById('canvas').getContext('2d').getImageData(x, y, 1, 1).data]"
    )
    return list(tab.evaluate(script, [x, y]))


def test_arrow_keys_steer_and_the_button_ends_the_node(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    turtlesim = ros.pipros.start("rosrun", "turtlesim", "turtlesim_node")
    tab = open_tab(Page.of(turtlesim), "")
    expect(tab).to_have_title("TurtleSim /turtlesim")
    wait_until(lambda: len(turtles_on(tab)) == 1, 30, "a turtle")
    assert pixel(tab, 5, 5) == [69, 86, 255, 255]
    assert pixel(tab, 250, 250) != [69, 86, 255, 255]

    def has_moved() -> bool:
        tab.keyboard.press("ArrowUp")  # a node that stalls misses a part of a command's second
        return float(str(turtles_on(tab)[0][1])) > 330

    wait_until(has_moved, 30, lambda: str(turtles_on(tab)))
    assert pixel(tab, 280, 249) == pytest.approx([179, 184, 255, 255], abs=3)  # browsers smooth lines
    assert ros.pipros.run("rosservice", "call", "/spawn", "2", "2", "0.2", "").returncode == 0
    wait_until(lambda: len(turtles_on(tab)) == 2, 30, "two turtles")
    expect(tab.get_by_label("Turtle to steer").locator("option")).to_have_text(["turtle1", "turtle2"])
    keep_screenshots(tab, "turtlesim")
    tab.get_by_role("button", name="Close turtlesim").click()
    expect(tab.locator("#system")).to_have_text("turtlesim has ended")
    assert turtlesim.wait() == 0
