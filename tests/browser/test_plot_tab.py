"""The Plot tab: fields to choose from, gaps, and values at the cursor."""

from __future__ import annotations

import re
import sys

from playwright.sync_api import expect

from tests.browser.conftest import OpenTab
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

CURVES = """
import math, rospy
from geometry_msgs.msg import Vector3
from std_msgs.msg import Float64
rospy.init_node("curves")
fast = rospy.Publisher("/fast", Float64, queue_size=10)
gaps = rospy.Publisher("/gaps", Float64, queue_size=10)
vector = rospy.Publisher("/vector", Vector3, queue_size=10)
rate, count = rospy.Rate(50), 0
while not rospy.is_shutdown():
    fast.publish(1.0)
    if count % 10 == 0:
        gaps.publish(5.0 if count % 20 else math.nan)
        vector.publish(1.0, 2.0, 3.0)
    count += 1
    rate.sleep()
"""
# The part of the chart's columns that have a pixel in a colour.
COLUMNS = """([red, green, blue]) => {
  const canvas = document.querySelector(".chart canvas");
  const { data, width, height } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const near = (value, wanted) => Math.abs(value - wanted) < 40;
  const columns = new Set();
  for (let i = 0; i < width * height; i += 1) {
    const at = i * 4;
    const [r, g, b, a] = data.subarray(at, at + 4);
    if (near(r, red) && near(g, green) && near(b, blue) && a > 200) columns.add(i % width);
  }
  return columns.size / width;
}"""
FIRST, SECOND, THIRD = (0x2F, 0x6F, 0xB3), (0xC0, 0x39, 0x2B), (0x1A, 0x7F, 0x37)


def test_a_topic_without_a_field_offers_its_numbers(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_bare_master()
    ros.pipros.start(sys.executable, "-c", CURVES)
    ros.wait_for_publisher("/vector")
    tab = open_tab(Page(ros), "plot")
    tab.get_by_label("Topic and field").fill("vector")
    tab.get_by_label("Topic and field").press("Enter")
    fields = tab.get_by_role("group", name="Fields")
    expect(fields.get_by_role("button", name="x", exact=True)).to_be_visible()
    fields.get_by_role("button", name="y", exact=True).click()
    expect(tab.locator(".legend")).to_contain_text("/vector/y: 2")
    expect(fields).to_be_hidden()
    assert tab.url.endswith("#plot//vector/y")


def test_nan_interrupts_a_curve_beside_a_faster_one(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_bare_master()
    ros.pipros.start(sys.executable, "-c", CURVES)
    ros.wait_for_publisher("/gaps")
    tab = open_tab(Page(ros), "plot//fast,/gaps")
    tab.get_by_label("Time span").select_option("10 s")
    expect(tab.locator(".legend")).to_contain_text(re.compile(r"/fast: 1.*/gaps: (5|\u2013)"))
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) > 0.3, 30, "three seconds of the faster curve")
    assert tab.evaluate(COLUMNS, SECOND) < 0.1


def test_each_curve_has_a_value_at_the_cursor(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_bare_master()
    ros.pipros.start(sys.executable, "-c", CURVES)
    ros.wait_for_publisher("/vector")
    tab = open_tab(Page(ros), "plot//fast,/vector/x,/vector/z")
    legend = tab.locator(".legend")
    expect(legend).to_contain_text(re.compile(r"/fast: 1.*/vector/x: 1.*/vector/z: 3"))
    wait_until(lambda: tab.evaluate(COLUMNS, THIRD) > 0.1, 30, "three seconds of a curve")
    tab.get_by_role("button", name="Pause").click()
    chart = tab.locator(".u-over").bounding_box()
    assert chart is not None
    for part in (0.97, 0.98, 0.99):
        tab.mouse.move(chart["x"] + chart["width"] * part, chart["y"] + chart["height"] / 2)
        expect(legend.locator(".at")).to_contain_text("at ")
        expect(legend).to_contain_text(re.compile(r"/fast: 1.*/vector/x: 1.*/vector/z: 3"))


def test_the_keys_move_the_time_axis_and_follow_again(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_bare_master()
    ros.pipros.start(sys.executable, "-c", CURVES)
    tab = open_tab(Page(ros), "plot//fast/data")
    expect(tab.locator(".chart canvas")).to_be_visible()
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) > 0.02, 30, "the curve")
    chart = tab.get_by_role("application", name="Curves")
    for _ in range(8):
        chart.press("ArrowRight")
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) == 0.0, 30, "the time after the newest sample")
    chart.press("0")
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) > 0.02, 30, "the curve again")
