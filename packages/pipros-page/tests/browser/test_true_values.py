"""Numbers in the page are those of the messages."""

import sys

from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
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
odd = publish("/odd", "64FC1", 16, bytes(2048), 128)
nan = publish("/nan", "32FC1", 16, struct.pack("<256f", *[float("nan")] * 128, *range(128)), 64)
def change(wanted):
    if wanted.data == "odd":
        red.publish(Image(height=16, width=16, encoding="64FC1", step=128, data=bytes(2048)))
    else:
        red.publish(Image(height=16, width=16, encoding="rgb8", step=48, data=good))
rospy.Subscriber("/change", String, change)
rospy.spin()
"""


def test_an_image_without_pixels_an_error_and_another_topic_clear_the_picture(
    ros: RosSystem, open_tab: OpenTab
) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", IMAGES)
    tab = open_tab(Page(ros), "images//red")
    picture = tab.locator(".picture canvas").first
    topic = tab.get_by_label("Topic", exact=True)
    for other, text in (("/empty", "it has no pixels: its size is 0"), ("/odd", "64FC1")):
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
            expect(tab.locator(".error").first).to_contain_text("64FC1")
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
