"""The Plot tab: fields to choose from, gaps, and values at the cursor."""

import re
import sys
from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots, show_all_controls
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

CURVES = """
import math, rospy
from geometry_msgs.msg import Point, PoseWithCovariance, Vector3
from std_msgs.msg import Float64
rospy.init_node("curves")
fast = rospy.Publisher("/fast", Float64, queue_size=10)
gaps = rospy.Publisher("/gaps", Float64, queue_size=10)
vector = rospy.Publisher("/vector", Vector3, queue_size=10)
covariance = rospy.Publisher("/covariance", PoseWithCovariance, queue_size=10)
circle = rospy.Publisher("/circle", Point, queue_size=10)
begin = rospy.get_time()
rate, count = rospy.Rate(50), 0
while not rospy.is_shutdown():
    fast.publish(1.0)
    circle.publish(3.0 * math.cos(count / 10), math.sin(count / 10), rospy.get_time() - begin)
    if count % 10 == 0:
        gaps.publish(5.0 if count % 20 else math.nan)
        vector.publish(1.0, 2.0, 3.0)
        covariance.publish(PoseWithCovariance())
    if count % 50 == 5:  # between two samples of /vector
        rospy.logerr("turn %d", count // 50)
    count += 1
    rate.sleep()
"""
ONE_SAMPLE = """
import rospy
from std_msgs.msg import Float64
rospy.init_node("once")
publisher = rospy.Publisher("/once", Float64, queue_size=10, latch=True)
publisher.publish(2.0)
rospy.spin()
"""
# the fraction of the chart's columns that have a pixel in a colour
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
MARK = (0xB3, 0x26, 0x1E)


@pytest.fixture
def curves(ros: RosSystem) -> RosSystem:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", CURVES)
    ros.wait_for_publisher("/circle")  # the last that it advertises
    return ros


def test_a_topic_without_a_field_offers_its_numbers(curves: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(curves), "plot")
    tab.get_by_role("group", name="Topics").get_by_role("button", name="/vector").click()
    fields = tab.get_by_role("group", name="Fields")
    expect(fields.get_by_role("button", name="x", exact=True)).to_be_visible()
    fields.get_by_role("button", name="y", exact=True).click()
    expect(tab.locator(".legend")).to_contain_text("/vector/y: 2")
    expect(fields).to_be_hidden()
    expect(tab).to_have_url(re.compile("#plot//vector/y$"))
    tab.get_by_role("button", name="Remove /vector/y").click()
    tab.get_by_role("group", name="Topics").get_by_role("button", name="/covariance").click()
    expect(fields.get_by_role("button", name="pose/position/x", exact=True)).to_be_visible()
    element = fields.get_by_role("button", name="covariance[0]", exact=True)
    expect(element).to_be_hidden()
    fields.get_by_text(re.compile(r"^\d+ covariances$")).click()
    element.click()
    expect(tab.locator(".legend")).to_contain_text("/covariance/covariance[0]: 0")


def test_names_that_are_wider_than_a_phone_are_broken(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    name = "/robot_0/very_long_topic_name/of/the/battery_of_camera_0/voltage"
    ros.pipros.start(sys.executable, "-c", ONE_SAMPLE.replace("/once", name))
    ros.wait_for_publisher(name)
    tab = open_tab(Page(ros), "plot", size=(390, 800))
    box = tab.get_by_text(name, exact=True).bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390


def test_nan_interrupts_a_curve_beside_a_faster_one(curves: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(curves), "plot//fast,/gaps")
    tab.get_by_label("Time span").select_option("10 s")
    expect(tab.locator(".legend")).to_contain_text(re.compile(r"/fast: 1.*/gaps: (5|\u2013)"))
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) > 0.3, 30, "three seconds of the faster curve")
    tab.get_by_role("button", name="Pause").click()
    assert tab.evaluate(COLUMNS, SECOND) < tab.evaluate(COLUMNS, FIRST) / 3


def test_each_curve_has_a_value_at_the_cursor(curves: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(curves), "plot//fast,/vector/x:z")
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


def test_the_keys_move_the_time_axis_and_follow_again(curves: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(curves), "plot//fast/data")
    expect(tab.locator(".chart canvas")).to_be_visible()
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) > 0.02, 30, "the curve")
    chart = tab.get_by_role("application", name="Curves")
    for key in ("-", "ArrowRight"):
        for _ in range(8):
            chart.press(key)
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) == 0.0, 30, "the time after the newest sample")
    chart.press("0")
    wait_until(lambda: tab.evaluate(COLUMNS, FIRST) > 0.02, 30, "the curve again")


def test_expressions_and_derivatives_on_a_second_axis(curves: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(curves), "plot//circle/z;d")
    legend = tab.locator(".legend")
    tab.get_by_label("Topic and field").fill("/vector=hypot(m.x, m.y, m.z)")
    tab.get_by_label("Topic and field").press("Enter")
    expect(legend).to_contain_text(re.compile(r"/circle/z d/dt: (0\.[89]|1(\.[012])?)"))
    expect(legend).to_contain_text("/vector=hypot(m.x, m.y, m.z): 3.741657")
    expect(tab.locator(".u-axis")).to_have_count(2)
    tab.get_by_role("button", name="Right axis of /vector").click()
    expect(tab.locator(".u-axis")).to_have_count(3)
    keep_screenshots(tab, "plot-axes")
    tab.reload()
    expect(tab.locator(".u-axis")).to_have_count(3)
    expect(legend).to_contain_text("hypot(m.x, m.y, m.z): 3.741657")
    tab.get_by_label("Topic and field").fill("/vector=m.w")
    tab.get_by_label("Topic and field").press("Enter")
    expect(legend).to_contain_text("Vector3 has no field [w]")


def test_curves_over_another_curve(curves: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(curves), "plot//circle/x")
    tab.get_by_label("X axis").select_option("first curve (x-y)")
    expect(tab.locator(".error")).to_contain_text("needs two curves")
    tab.get_by_label("Topic and field").fill("/circle/y")
    tab.get_by_label("Topic and field").press("Enter")
    # A circle fills the width of the chart; over time, its curve would grow from the right edge.
    wait_until(lambda: tab.evaluate(COLUMNS, SECOND) > 0.8, 30, "the circle")
    keep_screenshots(tab, "plot-xy")
    tab.locator(".u-over").hover()
    expect(tab.locator(".legend .at")).to_have_text(
        re.compile(r"nearest sample -?[\d.e-]+, -?[\d.e-]+ at \d\d:\d\d:\d\d\.\d\d")
    )
    expect(tab).to_have_url(re.compile("axis:xy"))


def test_log_entries_are_marks_that_the_cursor_names(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", CURVES)
    ros.wait_for_publisher("/circle")
    tab = open_tab(Page(ros), "plot//vector/x")
    tab.get_by_label("Time span").select_option("10 s")
    tab.get_by_label("Log entries").check()
    wait_until(lambda: tab.evaluate(COLUMNS, MARK) > 0.0021, 30, "three marks")
    tab.get_by_role("button", name="Pause").click()
    keep_screenshots(tab, "plot-marks")
    chart = tab.locator(".u-over").bounding_box()
    assert chart is not None
    at = tab.locator(".legend .at")

    def texts() -> Iterator[str]:
        for part in range(0, int(chart["width"]), 8):
            tab.mouse.move(chart["x"] + chart["width"] - 2 - part, chart["y"] + 20)
            yield at.inner_text()

    named: set[str] = set()

    def sweep() -> bool:
        named.update(found.group() for text in texts() if (found := re.search(r"Error /\S+: turn \d+", text)))
        return len(named) >= 3

    wait_until(sweep, 60, lambda: f"three marks named: {named}")


def test_samples_are_snapped_to_measured_filtered_and_saved(curves: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(curves), "plot//circle/x")
    legend = tab.locator(".legend")
    expect(legend).to_contain_text(re.compile(r"/circle/x: -?\d"))
    show_all_controls(tab)
    tab.get_by_label("Line at a value").fill("2.5")
    tab.get_by_label("Line at a value").press("Enter")
    expect(legend).to_contain_text("line 2.5")
    tab.get_by_role("button", name="where").click()
    where = tab.get_by_label("Only messages of /circle for which")
    where.fill("m.x > 0 and m.y > 0")
    where.press("Enter")
    expect(legend).to_contain_text(re.compile(r"/circle\{m\.x > 0 and m\.y > 0\}/x: \d"))
    tab.get_by_label("Statistics", exact=True).check()
    table = tab.get_by_role("region", name="Statistics of the shown part")
    least, most = table.locator("td.number").nth(1), table.locator("td.number").nth(2)
    wait_until(lambda: 0 < number_of(least.inner_text()) < 1 < number_of(most.inner_text()) < 3, 30, "both")
    number = table.locator("td.number").first
    # The part selected below is 3 s long. In four turns, which take 5 s, 63 samples meet the condition.
    wait_until(lambda: number_of(number.inner_text()) > 60, 60, "samples of more than 3 s")
    tab.get_by_role("button", name="Pause").click()
    chart = tab.locator(".u-over").bounding_box()
    tab.mouse.move(chart["x"] + chart["width"] * 0.99, chart["y"] + 30)
    expect(legend.locator(".at")).to_have_text(re.compile(r"^sample at \d\d:\d\d:\d\d\.\d\d$"))
    keep_screenshots(tab, "plot-statistics")
    all_samples = int(number.inner_text())
    left, middle = chart["x"] + chart["width"] * 0.9, chart["y"] + chart["height"] / 2
    sample = legend.locator(".at").inner_text()
    tab.mouse.move(left, middle)
    expect(legend.locator(".at")).not_to_have_text(sample)
    tab.mouse.down()
    tab.mouse.move(chart["x"] + chart["width"] - 2, middle, steps=4)
    selected = tab.locator(".u-select")
    wait_until(lambda: (selected.bounding_box() or {"width": 0})["width"] > 10, 30, "a selected part")
    tab.mouse.up()
    wait_until(lambda: int(number.inner_text()) < all_samples, 30, "fewer samples")
    with tab.expect_download() as download:
        tab.get_by_role("button", name="CSV of the shown part").click()
    lines = download.value.path().read_text().splitlines()
    assert len(lines) - 1 == int(number.inner_text()) > 0
    assert all(float(line.rsplit(",", 1)[1]) > 0 for line in lines[1:])
    tab.reload()
    expect(legend).to_contain_text("line 2.5")
    expect(tab.get_by_label("Statistics", exact=True)).to_be_checked()
    tab.get_by_role("button", name="Remove the line at 2.5").click()
    expect(legend).not_to_contain_text("line 2.5")


def test_a_part_next_to_a_single_sample_is_zoomed(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", ONE_SAMPLE)
    ros.wait_for_publisher("/once")
    tab = open_tab(Page(ros), "plot//once")
    expect(tab.locator(".legend")).to_contain_text(": 2")
    show_all_controls(tab)
    chart = tab.locator(".u-over").bounding_box()
    right, middle = chart["x"] + chart["width"], chart["y"] + chart["height"] / 2
    tab.mouse.move(right - 25, middle)  # the sample is nearer than 40 pixels to both ends
    tab.mouse.down()
    tab.mouse.move(right - 5, middle, steps=4)
    tab.mouse.up()
    expect(tab.get_by_role("button", name="CSV of the shown part")).to_be_visible()


def number_of(text: str) -> float:
    return float(text) if re.fullmatch(r"-?[\d.e-]+", text) else -1.0
