"""Zoom, values and colours of images, and transports that are not decoded."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.conftest import OpenTab, keep_screenshots
from tests.browser.test_tab_details import wait_for_corners
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "image_program.py"
VIDEO = """
import rospy
from rospy import AnyMsg

class Packet(AnyMsg):
    _type, _md5sum = "theora_image_transport/Packet", "33ac4e14a7cff32e7e0d65f18bb410f3"
    _full_text = "uint8[] data"

rospy.init_node("video")
kept = rospy.Publisher("/cam/image/theora", Packet, queue_size=1)
rospy.spin()
"""


def point_at(tab: Tab, x: int, y: int, size: int = 4) -> None:
    """Move the mouse to the middle of a pixel of a square image."""
    box: Any = tab.locator(".picture").bounding_box()
    side = min(box["width"], box["height"])
    left, top = box["x"] + (box["width"] - side) / 2, box["y"] + (box["height"] - side) / 2
    tab.mouse.move(left + (x + 0.5) * side / size, top + (y + 0.5) * side / size)


def test_a_depth_image_has_values_a_range_and_colours(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_bare_master()
    ros.pipros.start(sys.executable, PROGRAM)
    ros.wait_for_publisher("/image/compressed")
    tab = open_tab(Page(ros), "images/%2Fimage%2F32fc1")
    pixel = tab.locator(".pixel")
    expect(tab.get_by_label("Lowest value")).to_be_visible()
    wait_for_corners(tab, "[[0,0,0],[85,85,85],[170,170,170],[255,255,255]]", "the image")
    point_at(tab, 3, 0)
    expect(pixel).to_have_text("(3, 0): -0.15 m")
    tab.get_by_label("Lowest value").fill("-0.15")
    tab.get_by_label("Lowest value").press("Enter")
    wait_for_corners(tab, "[[0,0,0],[0,0,0],[125,125,125],[255,255,255]]", "the range")
    tab.get_by_label("Colours").select_option("rainbow")
    wait_for_corners(tab, "[[255,0,0],[255,0,0],[0,255,130],[255,0,255]]", "the colours")
    keep_screenshots(tab, "depth-colours")
    tab.get_by_label("Topic").select_option("/image/rgb8")
    expect(tab.get_by_label("Colours")).to_be_hidden()
    wait_for_corners(tab, "[[255,0,0],[0,255,0],[0,0,255],[255,255,255]]", "the other image")
    point_at(tab, 0, 3)
    expect(pixel).to_have_text("(0, 3): 0, 0, 255")


def test_a_picture_is_zoomed_moved_and_fitted(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_bare_master()
    ros.pipros.start(sys.executable, PROGRAM)
    ros.wait_for_publisher("/image/compressed")
    tab = open_tab(Page(ros), "images/%2Fimage%2Fmono8")
    expect(tab.locator(".picture canvas")).to_be_visible()
    wait_for_corners(tab, "[[0,0,0],[85,85,85],[170,170,170],[255,255,255]]", "the image")
    width = "document.querySelector('.picture canvas').getBoundingClientRect().width"
    before = tab.evaluate(width)
    point_at(tab, 3, 3)
    expect(tab.locator(".pixel")).to_have_text("(3, 3): 255, 255, 255")
    tab.mouse.wheel(0, -1000)
    wait_until(lambda: tab.evaluate(width) > 3 * before, 30, "the zoom")
    point_at(tab, 3, 3)  # the pixel under the mouse stays there
    expect(tab.locator(".pixel")).to_have_text("(3, 3): 255, 255, 255")
    keep_screenshots(tab, "image-zoomed")
    tab.mouse.down()
    tab.mouse.move(*[tab.locator(".picture").bounding_box()[side] + 900 for side in ("x", "y")])  # type: ignore[index]
    tab.mouse.up()
    point_at(tab, 3, 3)
    expect(tab.locator(".pixel")).not_to_have_text("(3, 3): 255, 255, 255")
    tab.locator(".picture").press("0")
    wait_until(lambda: tab.evaluate(width) == before, 30, "the whole picture")
    tab.get_by_role("button", name="Zoom in").click()
    wait_until(lambda: tab.evaluate(width) > before, 30, "the zoom")


def test_a_video_transport_names_republish(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_bare_master()
    ros.pipros.start(sys.executable, "-c", VIDEO)
    ros.wait_for_publisher("/cam/image/theora")
    tab = open_tab(Page(ros), "images/%2Fcam%2Fimage%2Ftheora")
    expect(tab.locator(".note")).to_have_text(
        "The transport theora is not decoded here. To see it, run: rosrun image_transport republish theora "
        "in:=/cam/image raw out:=/cam/image/republished"
    )
