"""Long keys, large latched messages, equal log entries, and transforms that arrive late."""

import json
import re
import sys
from itertools import product
from pathlib import Path

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

DIAGNOSTICS = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
rospy.init_node("monitor")
out = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1, latch=True)
values = [KeyValue("Temperature of the left motor winding", "1,2,3," * 200), KeyValue("k" * 300, "short")]
out.publish(DiagnosticArray(status=[DiagnosticStatus(name="/pump", values=values)]))
rospy.spin()
"""
LATCHED = """
import rospy
from std_msgs.msg import UInt8MultiArray
rospy.init_node("large")
out = rospy.Publisher("/large", UInt8MultiArray, queue_size=1, latch=True)
message = UInt8MultiArray(data=bytes(20_000_000))
message.layout.data_offset = 12345678
out.publish(message)
rospy.spin()
"""
NOTE_LABELS = """() => {
  const draw = CanvasRenderingContext2D.prototype.fillText;
  window.labels = [];
  CanvasRenderingContext2D.prototype.fillText = function note(text, ...more) {
    window.labels.push(text);
    draw.call(this, text, ...more);
  };
}"""
LOG = """
import rospy
rospy.init_node("logger")
rospy.sleep(1)
for _ in range(30):
    rospy.loginfo("loop")
rospy.logerr("motor lost")
for _ in range(20):
    rospy.loginfo("loop")
rospy.logerr("wheel lost")
rospy.spin()
"""


def test_a_long_value_leaves_room_for_its_key(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", DIAGNOSTICS)
    ros.wait_for_publisher("/diagnostics")
    tab = open_tab(Page(ros), "diagnostics/%2Fpump")
    key = tab.get_by_role("cell", name="Temperature of the left motor winding")
    expect(key).to_be_visible()
    # The height of its text, not of the row, which is as high as the value.
    lines = key.evaluate("""(cell) => {
      const range = document.createRange();
      range.selectNodeContents(cell);
      return [cell.clientWidth, range.getBoundingClientRect().height];
    }""")
    assert lines[0] >= 90
    assert lines[1] < 100
    assert tab.locator("aside").evaluate("(side) => side.scrollWidth <= side.clientWidth")
    keep_screenshots(tab, "long-keys")


LONG_NAMES = """
import math, rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Float64
rospy.init_node("n" * 200)
found = TransformStamped(child_frame_id="<b>" * 50)
found.header.frame_id, found.transform.rotation.w = "f" * 150, 1
tf2_ros.StaticTransformBroadcaster().sendTransform([found])
out = rospy.Publisher("/huge", Float64, queue_size=1)
for count in range(10**6):
    out.publish((1.7e308, -1.7e308, 1)[count % 3])
    rospy.sleep(0.1)
"""


def test_long_names_push_no_column_out_of_a_table(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", LONG_NAMES)
    ros.wait_for_publisher("/tf_static")
    page = Page(ros)
    for size, place in product(((1280, 800), (800, 700)), ("nodes", "tf", "topics")):
        tab = open_tab(page, place, size)
        tab.locator("tbody td", has_text=re.compile("n{20}|huge")).first.wait_for()
        assert tab.locator(".scroll:has(table)").evaluate("(all) => all.scrollWidth <= all.clientWidth")


def test_values_whose_difference_is_infinite_have_an_axis(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", LONG_NAMES)
    ros.wait_for_publisher("/huge")
    tab = open_tab(Page(ros), "plot/%2Fhuge%2Fdata")
    tab.evaluate(NOTE_LABELS)
    wait_until(lambda: {"0", "8e+307"} <= set(tab.evaluate("window.labels")), 30)


def test_a_large_latched_message_has_its_size(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", LATCHED)
    ros.wait_for_publisher("/large")
    tab = open_tab(Page(ros), "topics/%2Flarge")
    expect(tab.locator("aside dl")).to_contain_text(re.compile(r"Size20\.0 MB"))
    expect(tab.locator("aside .message")).to_contain_text("data: ")
    expect(tab.locator("aside dl")).to_contain_text("Messages1")
    expect(tab.locator("aside .curve")).to_contain_text("newest 12345678")


def test_equal_entries_fold_with_a_count_and_errors_are_found(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", LOG)
    tab = open_tab(Page(ros), "console")
    tab.get_by_label("Filter by node").fill("/logger")
    entries = tab.locator(".entry")
    expect(entries).to_have_text(
        [re.compile(text) for text in ("30loop$", "motor lost$", "20loop$", "wheel lost$")]
    )
    tab.get_by_role("button", name="Next error").click()
    expect(tab.locator("aside pre")).to_have_text("motor lost")
    tab.locator(".log").press("e")
    expect(tab.locator("aside pre")).to_have_text("wheel lost")
    entries.first.click()
    expect(tab.locator("aside")).to_contain_text("The newest of 30 entries since")
    keep_screenshots(tab, "console-folded")
    tab.get_by_label("Fold").uncheck()
    expect(tab.locator(".count")).to_have_text(re.compile(r"^52 of"))
    expect(entries.last).to_contain_text("wheel lost")
    expect(entries.nth(5)).to_be_attached()


def test_late_transforms_that_still_arrive_do_not_blame_their_sender(ros: RosSystem, open_tab) -> None:
    ros.serve_master()
    tab = open_tab(Page(ros, command="rviz"), "scene")
    tab.wait_for_function("() => document.querySelector('.tab-scene')?.scene?.displays.length > 0")
    text = tab.evaluate(
        """() => {
          const { scene } = document.querySelector(".tab-scene");
          const turned = { translation: { x: 0, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };
          const link = (parent, child, stamp) => ({
            header: { frame_id: parent, stamp }, child_frame_id: child, transform: turned });
          const [now, old] = [scene.now(), scene.now() - 20000000000n];
          const transforms = [link("map", "odom", old), link("odom", "base", now)];
          scene.addTransforms({ transforms }, false, "/data");
          return scene.explanation("base");
        }"""
    )
    assert text == (
        "The transform from [odom] to [map], sent by [/data], is 20 s old; newer ones still arrive: this "
        "browser is slow, or the sender's clock is behind."
    )


# Messages, values and rows are copied; tables are saved.


TWIST = "{linear: {x: 0.5, y: 0.0, z: 0.0}, angular: {x: 0.0, y: 0.0, z: -1.25}}"


@pytest.fixture
def tab(ros: RosSystem, open_tab: OpenTab) -> Tab:
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "/cmd_vel", "geometry_msgs/Twist", TWIST, "__name:=driver")
    ros.wait_for_publisher("/cmd_vel")
    tab = open_tab(Page(ros), "topics//cmd_vel")
    tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    expect(tab.locator(".message")).to_contain_text("-1.25")
    expect(tab.locator("tr[data-name='/cmd_vel']")).to_contain_text("/driver")
    tab.evaluate(NOTE_COPIED)
    return tab


# Notes the titles and texts of elements that say for a second that something was copied.
NOTE_COPIED = """() => {
  window.noted = [];
  new MutationObserver((changes) => {
    for (const { target } of changes) {
      if (!(target instanceof Element)) continue;
      if (target.matches(".copied") || target.textContent === "copied") {
        window.noted.push(`${target.title}: ${target.textContent}`);
      }
    }
  }).observe(document.body, { subtree: true, childList: true, attributes: true, attributeFilter: ["class"] });
}"""


def wait_for_note(tab: Tab, text: str) -> None:
    wait_until(lambda: text in tab.evaluate("window.noted"), 30, lambda: str(tab.evaluate("window.noted")))


def copied(tab: Tab) -> str:
    return str(tab.evaluate("navigator.clipboard.readText()")).replace("\r\n", "\n")


def test_a_message_is_copied_as_yaml_and_json(tab: Tab) -> None:
    tab.get_by_role("button", name="YAML").click()
    wait_for_note(tab, "Copy as YAML: copied")
    assert "angular: \n  x: 0.0\n  y: 0.0\n  z: -1.25" in copied(tab)
    tab.get_by_role("button", name="JSON").click()
    wait_for_note(tab, "Copy as JSON: copied")
    assert json.loads(copied(tab))["linear"] == {"x": 0.5, "y": 0.0, "z": 0.0}


def test_the_name_of_a_field_copies_its_value(tab: Tab) -> None:
    tab.locator(".message button.key", has_text="z:").last.press("Enter")
    wait_for_note(tab, "Copy the value: z:")
    assert copied(tab) == "-1.25"


def test_a_row_is_copied_with_the_keyboard(tab: Tab) -> None:
    tab.locator("tr[data-name='/cmd_vel']").focus()
    tab.keyboard.press("Control+c")
    assert copied(tab).split("\t")[:3] == ["/cmd_vel", "geometry_msgs/Twist", "/driver"]


def test_a_table_is_saved_as_csv(tab: Tab) -> None:
    with tab.expect_download() as download:
        tab.locator(".tab-topics").get_by_role("button", name="CSV").click()
    lines = Path(download.value.path()).read_text().splitlines()
    assert lines[0] == "Topic,Type,Publishers,Subscribers,Rate,Bandwidth"
    assert any(line.startswith("/cmd_vel,geometry_msgs/Twist,/driver,") for line in lines)


# Numbers in the page are those of the messages.


SOURCE = """
import rospy
from std_msgs.msg import Float64, Int64MultiArray, String, UInt64
rospy.init_node("source")
topics = {}
for name, message in (
    ("/serial", UInt64(2**64 - 1)),
    ("/list", Int64MultiArray(data=[-(2**53) - 1, 7])),
    ("/nan", Float64(float("nan"))),
    ("/zero", Float64(-0.0)),
    ("/text", String("nan")),
):
    topics[name] = rospy.Publisher(name, type(message), latch=True, queue_size=1)
    topics[name].publish(message)
rospy.spin()
"""


def test_numbers_are_shown_as_they_are(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", SOURCE)
    page = Page(ros)
    for topic, text in {
        "/serial": "data: 18446744073709551615", "/list": "[-9007199254740993, 7]", "/nan": "data: nan",
        "/zero": "data: -0.0", "/text": 'data: "nan"',
    }.items():  # fmt: skip
        tab = open_tab(page, f"topics/{topic}")
        expect(tab.locator("aside .message")).to_contain_text(text)
        expect(tab.locator("aside dd").nth(1)).to_have_text("latched")
        expect(tab.locator(f"tr[data-name='{topic}']")).to_contain_text("latched")
        tab.close()
    tab = open_tab(page, "plot//serial/data")
    expect(tab.locator(".curve").first).to_contain_text("18446744073709551615 (the curve is rounded)")


# Images show what was received last: nothing of an earlier image stays.


IMAGES = """
import struct, rospy
from sensor_msgs.msg import Image
from std_msgs.msg import String
rospy.init_node("source")
def publish(name, encoding, size, data, step):
    publisher = rospy.Publisher(name, Image, latch=True, queue_size=1)
    publisher.publish(Image(height=size, width=size, encoding=encoding, step=step, data=data))
    return publisher
good = b"\\xff\\x00\\x00" * 256
red = publish("/red", "rgb8", 16, good, 48)
empty = publish("/empty", "rgb8", 0, b"", 0)
odd = publish("/odd", "9FC1", 16, bytes(2048), 128)
nan = publish("/nan", "32FC1", 16, struct.pack("<256f", *[float("nan")] * 128, *range(128)), 64)
def change(wanted):
    if wanted.data == "odd":
        red.publish(Image(height=16, width=16, encoding="9FC1", step=128, data=bytes(2048)))
    else:
        red.publish(Image(height=16, width=16, encoding="rgb8", step=48, data=good))
rospy.Subscriber("/change", String, change)
rospy.spin()
"""


def test_an_image_without_pixels_an_error_and_another_topic_clear_the_picture(ros, open_tab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", IMAGES)
    tab = open_tab(Page(ros), "images//red")
    picture = tab.locator(".picture canvas").first
    topic = tab.get_by_label("Topic", exact=True)
    for other, text in (("/empty", "it has no pixels: its size is 0"), ("/odd", "9FC1")):
        topic.select_option("/red")
        expect(picture).to_be_visible()
        topic.select_option(other)
        expect(tab.locator(".error").first).to_contain_text(text)
        expect(picture).to_be_hidden()
    topic.select_option("/red")
    expect(picture).to_be_visible()
    for change in ("odd", "good"):
        ros.pipros.run("rostopic", "pub", "--once", "/change", "std_msgs/String", change)
        if change == "odd":
            expect(tab.locator(".error").first).to_contain_text("9FC1")
            expect(picture).to_be_hidden()
        else:
            expect(picture).to_be_visible()


def test_nan_is_hatched_and_differs_from_the_nearest_depth(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", IMAGES)
    tab = open_tab(Page(ros), "images//nan")
    picture = tab.locator(".picture canvas").first
    expect(picture).to_be_visible()
    pixels = """(canvas) => [[0, 0], [4, 0], [0, 8]].map(([x, y]) =>
      [...canvas.getContext("2d").getImageData(x, y, 1, 1).data].slice(0, 3))"""
    assert picture.evaluate(pixels) == [[123, 63, 168], [236, 226, 245], [0, 0, 0]]
    keep_screenshots(tab, "nan-depth")
