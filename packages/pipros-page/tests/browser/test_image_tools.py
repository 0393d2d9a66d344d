"""Zoom, values and colours of images, and transports that are not decoded."""

import sys
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots, show_all_controls
from tests.browser.test_tab_details import wait_for_corners
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "image_program.py"
VIDEO = """
import rospy
from rospy import AnyMsg

class Packet(AnyMsg):
    _type, _md5sum = "theora_image_transport/Packet", "33ac4e14a7cff32e7e0d65f18bb410f3"
    _full_text = "uint8[] data"

rospy.init_node("video")
kept = rospy.Publisher("/cam/image/theora", Packet, queue_size=1)
rospy.spin()
"""


def point_at(tab: Tab, x: int, y: int, size: int = 4) -> None:
    """Move the mouse to the middle of a pixel of a square image."""
    box: Any = tab.locator(".picture").bounding_box()
    side = min(box["width"], box["height"])
    left, top = box["x"] + (box["width"] - side) / 2, box["y"] + (box["height"] - side) / 2
    tab.mouse.move(left + (x + 0.5) * side / size, top + (y + 0.5) * side / size)


def test_a_depth_image_has_values_a_range_and_colours(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, PROGRAM)
    ros.wait_for_publisher("/image/compressed")
    tab = open_tab(Page(ros), "images/%2Fimage%2F32fc1")
    pixel = tab.locator(".pixel")
    expect(tab.get_by_label("Lowest value")).to_be_visible()
    wait_for_corners(tab, "[[0,0,0],[85,85,85],[170,170,170],[255,255,255]]", "the image")
    point_at(tab, 3, 0)
    expect(pixel).to_have_text("(3, 0): -0.15 m")
    tab.get_by_label("Lowest value").fill("-0.15")
    tab.get_by_label("Lowest value").press("Enter")
    wait_for_corners(tab, "[[0,0,0],[0,0,0],[125,125,125],[255,255,255]]", "the range")
    tab.get_by_label("Colours").select_option("rainbow")
    wait_for_corners(tab, "[[255,0,0],[255,0,0],[0,255,130],[255,0,255]]", "the colours")
    keep_screenshots(tab, "depth-colours")
    tab.get_by_label("Topic").select_option("/image/rgb8")
    expect(tab.get_by_label("Colours")).to_be_hidden()
    wait_for_corners(tab, "[[255,0,0],[0,255,0],[0,0,255],[255,255,255]]", "the other image")
    point_at(tab, 0, 3)
    expect(pixel).to_have_text("(0, 3): 0, 0, 255")


def test_a_picture_is_zoomed_moved_and_fitted(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, PROGRAM)
    ros.wait_for_publisher("/image/compressed")
    tab = open_tab(Page(ros), "images/%2Fimage%2Fmono8")
    expect(tab.locator(".picture canvas")).to_be_visible()
    wait_for_corners(tab, "[[0,0,0],[85,85,85],[170,170,170],[255,255,255]]", "the image")
    width = "document.querySelector('.picture canvas').getBoundingClientRect().width"
    before = tab.evaluate(width)
    point_at(tab, 3, 3)
    expect(tab.locator(".pixel")).to_have_text("(3, 3): 255, 255, 255")
    tab.mouse.wheel(0, -1000)
    wait_until(lambda: tab.evaluate(width) > 3 * before, 30, "the zoom")
    point_at(tab, 3, 3)  # the pixel under the mouse stays there
    expect(tab.locator(".pixel")).to_have_text("(3, 3): 255, 255, 255")
    keep_screenshots(tab, "image-zoomed")
    tab.mouse.down()
    tab.mouse.move(*[tab.locator(".picture").bounding_box()[side] + 900 for side in ("x", "y")])  # type: ignore[index]
    tab.mouse.up()
    point_at(tab, 3, 3)
    expect(tab.locator(".pixel")).not_to_have_text("(3, 3): 255, 255, 255")
    tab.locator(".picture").press("0")
    wait_until(lambda: tab.evaluate(width) == before, 30, "the whole picture")
    tab.get_by_role("button", name="Zoom in").click()
    wait_until(lambda: tab.evaluate(width) > before, 30, "the zoom")


STEREO = """
import rospy
from geometry_msgs.msg import Point
from genpy.dynamic import generate_dynamic
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

RULE = "=" * 80
TEXT = RULE.join((
    "std_msgs/Header header\\nvision_msgs/Detection2D[] detections\\n",
    "\\nMSG: std_msgs/Header\\nuint32 seq\\ntime stamp\\nstring frame_id\\n",
    "\\nMSG: vision_msgs/Detection2D\\nvision_msgs/Result[] results\\nvision_msgs/BoundingBox2D bbox\\n",
    "\\nMSG: vision_msgs/Result\\nint64 id\\nfloat64 score\\n",
    "\\nMSG: vision_msgs/BoundingBox2D\\ngeometry_msgs/Pose2D center\\nfloat64 size_x\\nfloat64 size_y\\n",
    "\\nMSG: geometry_msgs/Pose2D\\nfloat64 x\\nfloat64 y\\nfloat64 theta\\n",
))
types = generate_dynamic("vision_msgs/Detection2DArray", TEXT)
Found = types["vision_msgs/Detection2DArray"]
rospy.init_node("stereo")
left = rospy.Publisher("/left/image_raw", Image, queue_size=1)
right = rospy.Publisher("/right/image_raw", Image, queue_size=1)
info = rospy.Publisher("/left/camera_info", CameraInfo, queue_size=1)
found = rospy.Publisher("/found", Found, queue_size=1)
tags = rospy.Publisher("/tags", MarkerArray, queue_size=1)
video = rospy.Publisher("/left/video/compressed", CompressedImage, queue_size=1)
data = bytes(40 + (x + 2 * y) % 60 for y in range(48) for x in range(64) for _ in range(3))
other = bytes(value + (30 if at // 3 % 64 >= 32 else 0) for at, value in enumerate(data))
box = types["vision_msgs/Detection2D"]()
box.bbox.center.x, box.bbox.center.y, box.bbox.size_x, box.bbox.size_y = 20, 24, 16, 12
best = types["vision_msgs/Result"]()
best.id, best.score = 7, 0.875
box.results.append(best)
tag = Marker(type=Marker.CUBE, ns="tags")
tag.header.frame_id = "camera"
tag.scale.x = tag.scale.y = tag.scale.z = 0.5
tag.color.g = tag.color.a = tag.pose.orientation.w = 1
tag.pose.position.x, tag.pose.position.z = 0.5, 2
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    now = rospy.Time.now()
    for out, pixels, after in ((left, data, 0), (right, other, 4_000_000)):
        header = Header(stamp=now + rospy.Duration(0, after), frame_id="camera")
        out.publish(Image(header=header, width=64, height=48, step=192, encoding="rgb8", data=pixels))
    header = Header(stamp=now, frame_id="camera")
    info.publish(CameraInfo(header=header, width=64, height=48, P=[50, 0, 32, 0, 0, 50, 24, 0, 0, 0, 1, 0]))
    found.publish(Found(header=header, detections=[box]))
    tags.publish(MarkerArray([tag]))
    video.publish(CompressedImage(header=header, format="h264", data=b"0001"))
    rate.sleep()
"""
OVER = """([x, y]) => {
  const over = document.querySelector(".picture canvas.over");
  if (!over) return [0, 0, 0, 0];
  const times = over.width / 64;
  return [...over.getContext("2d").getImageData(x * times, y * times, 1, 1).data];
}"""
AT = """([x, y]) => {
  const drawing = document.querySelector(".picture canvas").getContext("2d");
  return [...drawing.getImageData(x, y, 1, 1).data].slice(0, 3);
}"""


def test_two_images_are_paired_and_subtracted(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", STEREO)
    ros.wait_for_publisher("/left/video/compressed")
    tab = open_tab(Page(ros), "images//left/image_raw")
    tab.get_by_label("Pair with").select_option("/right/image_raw")
    expect(tab.locator(".picture canvas:not(.over):visible")).to_have_count(2)
    expect(tab.locator(".tab-images .bar")).to_contain_text("4.0 ms apart")
    keep_screenshots(tab, "image-pair")
    show_all_controls(tab)
    tab.get_by_role("button", name="Zoom in").click()
    zoomed = "[...document.querySelectorAll('.picture > canvas')].map((each) => each.style.transform)"
    wait_until(lambda: "scale(1.25)" in tab.evaluate(zoomed)[0], 30, "the zoom")
    assert len(set(tab.evaluate(zoomed))) == 1  # both are zoomed
    tab.locator(".picture").nth(1).press("0")
    wait_until(lambda: tab.evaluate(zoomed) == ["", ""], 30, "both pictures as a whole")
    tab.get_by_label("Show the pair as").select_option("difference")
    expect(tab.locator(".picture canvas:not(.over):visible")).to_have_count(1)
    wait_until(lambda: tab.evaluate(AT, [50, 20]) == [30, 30, 30], 30, "the difference")
    assert tab.evaluate(AT, [10, 20]) == [0, 0, 0]
    keep_screenshots(tab, "image-difference")
    tab.reload()
    expect(tab.get_by_label("Show the pair as")).to_have_value("difference")
    expect(tab.get_by_label("Pair with")).to_have_value("/right/image_raw")


def test_detections_and_markers_are_drawn_over_an_image(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", STEREO)
    ros.wait_for_publisher("/left/video/compressed")
    tab = open_tab(Page(ros), "images//left/image_raw")
    tab.get_by_label("Overlay").select_option("/found")
    yellow, green, nothing = [0xFF, 0xD8, 0x4A, 255], [0, 255, 0, 255], [0, 0, 0, 0]
    wait_until(lambda: tab.evaluate(OVER, [12, 26]) == yellow, 30, "the left edge of the box")
    assert [tab.evaluate(OVER, place) for place in ([20, 30], [20, 25])] == [yellow, nothing]
    keep_screenshots(tab, "image-detections")
    tab.get_by_label("Overlay").select_option("/tags")
    # the near face is 1.75 m away: 50 * (0.5 - 0.25) / 1.75 + 32 = 39.1
    edge = [39.14, 24]
    wait_until(lambda: tab.evaluate(OVER, edge) == green, 30, "the left edge of the near face")
    assert tab.evaluate(OVER, [20, 24]) == nothing
    point = tab.locator(".pixel").first
    value = 40 + (39 + 2 * 24) % 60

    def shows_the_pixel_below_the_mouse() -> bool:
        # moves until the lines around it are complete
        box: Any = tab.locator(".picture").first.bounding_box()
        scale = min(box["width"] / 64, box["height"] / 48)
        left, top = (box["x"] + (box["width"] - 64 * scale) / 2, box["y"] + (box["height"] - 48 * scale) / 2)
        tab.mouse.move(left + 39.5 * scale, top + 24.5 * scale)
        return point.inner_text() == f"(39, 24): {value}, {value}, {value}"  # of the image, not of the marker

    wait_until(shows_the_pixel_below_the_mouse, 30, "the pixel of the image")
    keep_screenshots(tab, "image-markers")
    tab.get_by_label("Overlay").select_option("nothing")
    wait_until(lambda: tab.evaluate(OVER, edge) == nothing, 30, "the image alone")


STAMPED = """async (found) => {
  const { imageStage } = await import("/image_stage.js");
  const stage = imageStage();
  const colours = [];
  for (const [stamp, over] of found) {
    const size = { width: 1, height: 1, full: [4, 4] };
    const head = JSON.stringify({ stamp, encoding: "mono8", color: "gray", depth: "8U", ...size });
    await stage.show(new DataView(new TextEncoder().encode(`${head}\\n0`).buffer));
    const shapesOf = (color) => (color ? [{ color, circles: [2, 2, 1] }] : []);
    stage.over(over.map(([at, color]) => ({ stamp: at, shapes: shapesOf(color) })));
    const drawn = stage.area.querySelector(".over");
    const at = drawn && [3, 2].map((place) => place * (drawn.width / 4));
    colours.push(drawn && [...drawn.getContext("2d").getImageData(...at, 1, 1).data].slice(0, 3));
  }
  return colours;
}"""


def test_detections_are_drawn_over_the_image_of_their_stamp(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    tab = open_tab(Page(ros), "images")
    red, green = [255, 0, 0], [0, 255, 0]
    s = 1_000_000_000
    steps = [
        (10 * s, [], None),
        (10 * s, [(10 * s, "#f00"), (10 * s + s // 5, "#0f0")], red),
        (10 * s + s // 4, [], green),  # the newest of about that time
        (12 * s, [], None),
        (12 * s, [(0, "#f00")], red),  # without a stamp
        (12 * s, [(0, "")], None),  # nothing is found any more
        (0, [(20 * s, "#0f0")], green),
    ]
    assert tab.evaluate(STAMPED, [step[:2] for step in steps]) == [step[2] for step in steps]


@pytest.mark.parametrize(("program", "topic", "place", "transport"), [
    (VIDEO, "/cam/image/theora", "images/%2Fcam%2Fimage%2Ftheora", "theora"),
    (STEREO, "/left/video/compressed", "images//left/video/compressed", "h264"),
])  # fmt: skip
def test_video_names_republish(ros, open_tab, program: str, topic: str, place: str, transport: str) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", program)
    ros.wait_for_publisher(topic)
    tab, base = open_tab(Page(ros), place), topic.rpartition("/")[0]
    expect(tab.locator(".note")).to_have_text(
        f"The transport {transport} is not decoded here. To see it, run: rosrun image_transport republish "
        f"{transport} in:={base} raw out:={base}/republished"
    )
    expect(tab.locator(".error")).to_have_text("")
