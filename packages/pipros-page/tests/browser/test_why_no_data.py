"""Topics, displays, curves and images without data: their reason, and the marks of wrong types."""

import contextlib
import re
import signal
import sys
from collections.abc import Iterator, Sequence

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.browser.test_opencv_windows import PROGRAM as WINDOWS
from tests.support.page import Page
from tests.support.processes import Process
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


# Pages whose server is suspended: the connection stays open, but nothing is current.


SILENT = re.compile(r"no answer from the server for \d+ s")
SOURCE = """
import rospy
from std_msgs.msg import Float64
rospy.init_node("source")
publisher = rospy.Publisher("/speed", Float64, queue_size=1)
rate = rospy.Rate(20)
number = 0
while not rospy.is_shutdown():
    publisher.publish(number)
    number += 1
    rate.sleep()
"""
NODES = {
    "turtlesim": (["rosrun", "turtlesim", "turtlesim_node"], "#world"),
    "sim": (["rosrun", "pipros_sim", "sim"], "#world"),
    "sliders": (["rosrun", "rqt_robot_steering", "rqt_robot_steering"], "#panel"),
    "windows": ([sys.executable, "-c", WINDOWS], "#panel"),
}


@contextlib.contextmanager
def suspended(process: Process) -> Iterator[None]:
    process.send_signal(signal.SIGSTOP)
    try:
        yield
    finally:
        process.send_signal(signal.SIGCONT)


def test_nothing_looks_alive_while_the_server_is_silent(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", SOURCE)
    page = Page(ros, "--control")
    tab = open_tab(page, "topics//speed")
    rate = tab.locator("aside dd .rate").first
    row = tab.locator("tr[data-name='/speed'] .rate").first
    for each in (rate, row):
        expect(each).to_contain_text("Hz")
    expect(tab.locator("#system")).to_contain_text("can change the system")
    with suspended(page.process):
        expect(tab.locator("#system")).to_have_text(SILENT)
        expect(rate).to_have_text("stale")
        expect(row).to_have_text("stale")
        expect(tab.locator("#view")).to_have_class("outdated")
        assert rate.evaluate("(each) => getComputedStyle(each).color") == tab.locator("aside").evaluate(
            "(each) => getComputedStyle(each).color"
        )
        keep_screenshots(tab, "silent-server")
    expect(tab.locator("#system")).to_contain_text("can change the system")
    expect(rate).to_contain_text("Hz")
    expect(tab.locator("#view")).not_to_have_class("outdated")


def test_nothing_is_done_later_that_was_requested_of_a_silent_server(ros: RosSystem, open_tab) -> None:
    ros.serve_master()
    page = Page(ros, "--control")
    tab = open_tab(page, "publish")
    tab.get_by_label("Topic", exact=True).fill("/late")
    tab.get_by_label("Type", exact=True).fill("std_msgs/Empty")
    start = tab.get_by_role("button", name=re.compile("^Publish"))
    expect(start.first).to_be_enabled()
    with suspended(page.process):
        expect(tab.locator("#system")).to_have_text(SILENT)
        start.first.click()
        expect(tab.get_by_text("not done: no answer from the server")).to_be_visible()
    expect(tab.locator("#system")).to_contain_text("can change the system")
    expect(tab.locator("#publishers")).to_be_hidden()
    assert "/late" not in ros.pipros.run("rostopic", "list").stdout


@pytest.mark.parametrize(("command", "content"), NODES.values(), ids=NODES)
def test_the_page_of_a_suspended_node_says_so(ros, open_tab, command: Sequence[str], content: str) -> None:
    ros.serve_master()
    node = ros.pipros.start(*command)
    tab = open_tab(Page.of(node), "")
    expect(tab.locator("#node")).not_to_be_empty()
    expect(tab.locator(content)).not_to_have_class("outdated")
    with suspended(node):
        expect(tab.locator("#system")).to_have_text(SILENT)
        expect(tab.locator(content)).to_have_class("outdated")
    expect(tab.locator("#system")).to_have_text("")
    expect(tab.locator(content)).not_to_have_class("outdated")
