"""The bell in the head of the page, and what it names as stale in the tabs."""

import re
import sys

from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem

ARM = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import Imu
from std_msgs.msg import Empty
from tf2_msgs.msg import TFMessage
rospy.init_node("arm_driver")
transforms = rospy.Publisher("/tf", TFMessage, queue_size=10)
imus = rospy.Publisher("/arm/imu", Imu, queue_size=10)
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
moving = True
def stop(_):
    global moving
    moving = False
rospy.Subscriber("/stop", Empty, stop)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    if moving:
        made = TransformStamped()
        made.header.stamp = rospy.Time.now()
        made.header.frame_id, made.child_frame_id = "base", "hand"
        made.transform.rotation.w = 1
        transforms.publish(TFMessage([made]))
        imus.publish(Imu())
        diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(0, "/Arm/motor", "OK", "", [])]))
    rate.sleep()
"""
LISTENER = """
import rospy
from sensor_msgs.msg import Imu
from std_msgs.msg import Empty
rospy.init_node("listener")
rospy.Subscriber("/arm/imu", Imu, lambda _: None)
rospy.Subscriber("/stop", Empty, lambda _: rospy.logerr("the arm does not answer"))
rospy.spin()
"""


def test_the_bell_lists_what_became_stale_and_errors_and_leads_there(
    ros: RosSystem, open_tab: OpenTab
) -> None:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", ARM)
    ros.pipros.start(sys.executable, "-c", LISTENER)
    ros.wait_for_publisher("/arm/imu")
    tab = open_tab(Page(ros), "topics")
    bell = tab.locator("#bell")
    row = tab.locator("tr[data-name='/arm/imu']")
    expect(row).to_contain_text(re.compile(r"\d Hz"))
    tab.wait_for_timeout(7000)  # for the intervals of six observations
    ros.pipros.start("rostopic", "pub", "-1", "/stop", "std_msgs/Empty")
    expect(bell).to_have_attribute("aria-label", re.compile(r"[3-9] stale now"))
    expect(row.locator(".stale")).to_have_text("stale")
    assert row.locator(".stale").evaluate("(each) => getComputedStyle(each).color") == "rgb(123, 63, 168)"
    tab.keyboard.press("a")
    menu = tab.get_by_role("group", name="Changes in the last minute")
    for text in ("stale frame hand", "stale topic /arm/imu", "stale component /Arm/motor"):
        expect(menu.get_by_role("link").filter(has_text=text.split(" ", 1)[1]).first).to_contain_text("stale")
    expect(menu).to_contain_text("node /listener the arm does not answer")
    keep_screenshots(tab, "bell")
    menu.get_by_role("link").first.press("ArrowDown")
    expect(menu.get_by_role("link").nth(1)).to_be_focused()
    menu.get_by_role("link").filter(has_text="frame hand").first.press("Enter")
    expect(menu).to_be_hidden()
    expect(tab).to_have_url(re.compile("#tf/hand$"))
    stale = tab.locator("tr[data-name='hand'] .stale").first
    expect(stale).to_have_text("stale")
    keep_screenshots(tab, "stale-frame")
    tab.evaluate("location.hash = 'diagnostics'")
    expect(tab.locator(".badge.diagnostic-3")).to_have_text("Stale: 1")
    keep_screenshots(tab, "stale-component")
    tab.evaluate("location.hash = 'graph/node:/listener'")
    expect(tab.locator("aside .stale")).to_have_text("stale")
    expect(tab.locator(".graph g.link.stale .arrow").first).to_be_attached()
    keep_screenshots(tab, "stale-graph")
