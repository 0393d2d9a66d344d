"""Topics, displays, curves and images without data: their reason, and the marks of wrong types."""

from __future__ import annotations

import sys

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem

DRIVER = """
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import Float64, String
rospy.init_node("driver")
voltage = rospy.Publisher("/battery_voltage", Float64, queue_size=1)
silent = rospy.Publisher("/detections", String, queue_size=1)
camera = rospy.Publisher("/left/image_raw", Image, queue_size=1)
rospy.Timer(rospy.Duration(0.1), lambda _: voltage.publish(12.5))
rospy.spin()
"""
LOGGER = """
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import Float32
rospy.init_node("logger_node")
rospy.Subscriber("/battery_voltage", Float32, print)
rospy.Subscriber("/left/image_rect", Image, print)
rospy.spin()
"""


@pytest.fixture
def page(ros: RosSystem) -> Page:
    """`/logger_node` wants `/battery_voltage` with a wrong type, and an image with a wrong name."""
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", DRIVER)
    ros.wait_for_publisher("/battery_voltage")
    ros.pipros.start(sys.executable, "-c", LOGGER)
    ros.wait_for_subscriber("/battery_voltage")
    return Page(ros)


def ask(tab: Tab, topic: str) -> None:
    tab.get_by_role("button", name=f"Why no data on {topic}?").click()


def test_a_wrong_type_is_a_red_dashed_arrow_with_both_types(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "graph")
    arrow = tab.locator("g.link.wrong path.arrow")
    expect(arrow).to_have_count(1)
    expect(tab.locator("g.label.wrong text")).to_have_text("sent std_msgs/Float64, wanted std_msgs/Float32")
    style = arrow.evaluate(
        "(path) => [getComputedStyle(path).stroke, getComputedStyle(path).strokeDasharray]"
    )
    assert style == ["rgb(179, 38, 30)", "5px, 3px"]
    keep_screenshots(tab, "wrong-type")
    tab.locator('[data-key="node:/logger_node"]').click()
    expect(tab.locator("aside")).to_contain_text(
        "Wrong type on /battery_voltage: sent std_msgs/Float64, wanted std_msgs/Float32"
    )
    tab.get_by_label("What is shown").select_option("nodes")
    expect(tab.locator("g.label.wrong text")).to_contain_text("/battery_voltage  sent std_msgs/Float64")


def test_topics_mark_a_wrong_type_and_say_why_there_are_no_data(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "topics")
    mark = tab.locator("[data-name='/battery_voltage'] .wrong-type")
    expect(mark).to_have_attribute(
        "title", "/driver sends std_msgs/Float64, /logger_node wants std_msgs/Float32"
    )
    expect(tab.locator(".wrong-type")).to_have_count(1)
    tab.get_by_role("row", name="/battery_voltage").click()
    expect(tab.locator("aside .message")).to_contain_text("12.5")
    expect(tab.locator("aside .why")).to_be_hidden()  # messages arrive
    expect(tab.locator("aside .wrong-type")).to_contain_text("/logger_node wants std_msgs/Float32")
    tab.evaluate("() => { location.hash = 'topics/detections'; }")  # a name without its leading slash
    expect(tab.locator("aside h2")).to_have_text("/detections")
    expect(tab.get_by_role("row", name="/detections")).to_be_focused()  # no outline is left on another row
    ask(tab, "/detections")
    expect(tab.locator("aside .why")).to_contain_text("connected, but sent nothing on [/detections]")
    expect(tab.locator("aside .why .fails")).to_contain_text("messages: ")
    keep_screenshots(tab, "why-topic")


def test_images_and_curves_without_data_say_why(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "images/%2Fleft%2Fimage_rect")
    ask(tab, "/left/image_rect")
    expect(tab.locator(".why")).to_contain_text("but [/left/image_raw] is published")
    keep_screenshots(tab, "why-image")
    tab = open_tab(page, "plot/%2Fdetections%2Fdata")
    ask(tab, "/detections")
    expect(tab.locator(".why")).to_contain_text("sent nothing on [/detections]")
    keep_screenshots(tab, "why-curve")
    tab.get_by_label("Remove /detections/data").click()
    expect(tab.locator(".why")).to_be_hidden()


def test_a_display_without_data_says_why(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "scene")
    tab.get_by_label("Add a display").select_option("rviz/Image")
    tab.get_by_label("Image Topic").fill("/left/image_raw")
    tab.get_by_label("Image Topic").press("Enter")
    ask(tab, "/left/image_raw")
    expect(tab.locator(".scene-tree .why:visible")).to_contain_text("sent nothing on [/left/image_raw]")
    keep_screenshots(tab, "why-display")


def test_a_check_is_refused_for_bad_names(page: Page) -> None:
    with page.connect() as browser:
        assert "must be a global name" in browser.act("why_no_data", name="no name")["error"]
        check = browser.act("why_no_data", name="/nothing")
    assert check["finding"]["rule"] == "no-publishers"
