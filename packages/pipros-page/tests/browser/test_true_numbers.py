"""Numbers in the page are those of the messages."""

from __future__ import annotations

import sys

from playwright.sync_api import expect

from tests.browser.chromium import OpenTab
from tests.support.page import Page
from tests.support.ros import RosSystem

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
