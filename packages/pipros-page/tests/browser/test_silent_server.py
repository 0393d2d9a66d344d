"""Pages whose server is suspended: the connection stays open, but nothing is current."""

from __future__ import annotations

import contextlib
import re
import signal
import sys
from collections.abc import Iterator, Sequence

import pytest
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.browser.test_opencv_windows import PROGRAM as WINDOWS
from tests.support.page import Page
from tests.support.processes import Process
from tests.support.ros import RosSystem

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


def test_nothing_is_done_later_that_was_requested_of_a_silent_server(
    ros: RosSystem, open_tab: OpenTab
) -> None:
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
def test_the_page_of_a_suspended_node_says_so(
    ros: RosSystem, open_tab: OpenTab, command: Sequence[str], content: str
) -> None:
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
