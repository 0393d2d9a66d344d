"""Long keys, large latched messages, equal log entries, and transforms that arrive late."""

from __future__ import annotations

import re
import sys

from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem

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
out.publish(UInt8MultiArray(data=bytes(20_000_000)))
rospy.spin()
"""
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


def test_a_large_latched_message_has_its_size(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", LATCHED)
    ros.wait_for_publisher("/large")
    tab = open_tab(Page(ros), "topics/%2Flarge")
    expect(tab.locator("aside dl")).to_contain_text(re.compile(r"Size20\.0 MB"))
    expect(tab.locator("aside .message")).to_contain_text("data: ")
    expect(tab.locator("aside dl")).to_contain_text("Messages1")


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


def test_late_transforms_that_still_arrive_do_not_blame_their_sender(
    ros: RosSystem, open_tab: OpenTab
) -> None:
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
