"""Image nodelets as launch files start them: a depth camera, and two cameras with a view of disparities."""

from collections.abc import Iterator
from typing import Any

import cv2
import numpy
import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.nodes import Inbox
from tests.support.page import Page
from tests.support.pictures_of_cameras import camera_info, depths, image, picture, right_info, stereo_pair
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# As launch files of depth cameras do: raw colours and depths become coloured points.
RGBD = """<launch>
  <group ns="camera">
    <node pkg="nodelet" type="nodelet" name="camera_nodelet_manager" args="manager" output="screen"/>
    <include file="$(find image_proc)/launch/image_proc.launch" ns="rgb">
      <arg name="manager" value="/camera/camera_nodelet_manager"/>
    </include>
    <node pkg="nodelet" type="nodelet" name="metric"
          args="load depth_image_proc/convert_metric camera_nodelet_manager --no-bond">
      <remap from="image_raw" to="depth_registered/image_raw"/>
      <remap from="image" to="depth_registered/image_rect"/>
    </node>
    <node pkg="nodelet" type="nodelet" name="points"
          args="load depth_image_proc/point_cloud_xyzrgb camera_nodelet_manager --no-bond"/>
  </group>
</launch>
"""


def send_until(inbox: Inbox, publishers: dict[str, Any], messages: Any) -> Any:
    """Publish the messages of one moment after the other until something arrives. Return it."""
    numbers = iter(range(1, 10**6))

    def is_there() -> bool:
        number = next(numbers)
        for topic, message in messages(number).items():
            publishers[topic].publish(message)
        return bool(inbox.messages)

    wait_until(is_there, 120)
    return inbox.messages[0]


def test_a_launch_file_turns_a_depth_camera_into_colored_points(ros: RosSystem) -> None:
    (ros.home / "rgbd.launch").write_text(RGBD)
    launch = ros.pipros.start("roslaunch", "-p", str(ros.port), "rgbd.launch")
    launch.wait_for(r"nodelet /camera/points \(depth_image_proc/point_cloud_xyzrgb\) runs in Python")
    inbox = Inbox()
    raw, depth = picture(1), depths("16UC1")

    def messages(number: int) -> dict[str, Any]:
        return {
            "rgb/image_raw": image(raw, "bayer_rggb8", number),
            "rgb/camera_info": camera_info(number),
            "depth_registered/image_raw": image(depth, "16UC1", number),
        }

    ros.wait_for_publisher("/camera/depth_registered/points")
    with Node("camera_driver", environment=Environment(master_uri=ros.master_uri)) as node:
        cloud = load_message_class("sensor_msgs/PointCloud2")
        publishers = {
            topic: node.advertise(f"/camera/{topic}", type(message), queue_size=1)
            for topic, message in messages(0).items()
        }
        assert ros.subscribers("/camera/rgb/image_raw") == []
        subscriber = node.subscribe("/camera/depth_registered/points", cloud, inbox, queue_size=1)
        points = send_until(inbox, publishers, messages)
        floats = np.frombuffer(points.data, np.float32).reshape(480, 640, 8)
        assert np.nanmax(np.abs(floats[:, :, 2] - np.where(depth == 0, np.nan, depth / 1000))) < 1e-5
        assert floats[:, :, 4].view(np.uint32).any()
        subscriber.unregister()
        wait_until(lambda: ros.subscribers("/camera/rgb/image_raw") == [], 60)
    launch.press_ctrl_c()
    launch.wait()


def test_two_cameras_become_disparities_points_and_a_picture_of_them(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start("rosrun", "stereo_image_proc", "stereo_image_proc", "__ns:=/stereo")
    view = ros.pipros.start(
        "rosrun", "image_view", "disparity_view", "image:=/stereo/disparity", "_window_name:=near"
    )
    left, right = stereo_pair()

    def messages(number: int) -> dict[str, Any]:
        plain = {"D": [0.0] * 5}
        other = right_info(number)
        other.D = [0.0] * 5
        return {
            "left/image_raw": image(left, "mono8", number), "left/camera_info": camera_info(number, **plain),
            "right/image_raw": image(right, "mono8", number), "right/camera_info": other,
        }  # fmt: skip

    inbox = Inbox()
    with Node("cameras", environment=Environment(master_uri=ros.master_uri)) as node:
        publishers = {
            topic: node.advertise(f"/stereo/{topic}", type(message), queue_size=1)
            for topic, message in messages(0).items()
        }
        node.subscribe("/stereo/points2", load_message_class("sensor_msgs/PointCloud2"), inbox, queue_size=1)
        points = send_until(inbox, publishers, messages)
        floats = np.frombuffer(points.data, np.float32).reshape(480, 640, 8)
        found = np.isfinite(floats[:, :, 2])
        assert found.mean() > 0.5
        assert (np.abs(floats[found][:, 2]) > 1).all()
        with Page.of(view).connect() as browser:
            shown = browser.watch("image", window="near")
            for topic, message in messages(10**6).items():
                publishers[topic].publish(message)
            assert len(next(shown)) > 1000
    view.press_ctrl_c()
    assert view.wait() == 0


# Windows of OpenCV on a page: images, keys, trackbars and the mouse, for builds of OpenCV without a GUI.


BEFORE, AFTER = (
    "import cv2, rospy\nrospy.init_node('viewer')",
    "import rospy\nrospy.init_node('viewer')\nimport cv2",
)
PROGRAM = """
import numpy
image = numpy.zeros((40, 60, 3), numpy.uint8)
image[:, :, 2] = 255
cv2.namedWindow("view")
cv2.createTrackbar("hue", "view", 10, 179, lambda value: print("hue", value, flush=True) or 0)
cv2.setMouseCallback("view", lambda *seen: print("mouse", *seen, flush=True), "mine")
cv2.imshow("view", image)
print("at", cv2.getTrackbarPos("hue", "view"), flush=True)
while True:
    key = cv2.waitKey(10)
    if key == ord("q"):
        break
    if key == ord("b"):
        image[:] = (255, 0, 0)
        cv2.imshow("view", image)
cv2.destroyAllWindows()
print("open", cv2.getWindowProperty("view", cv2.WND_PROP_VISIBLE), flush=True)
print("end", cv2.waitKey(0), flush=True)
rospy.spin()
"""


@pytest.fixture(params=[BEFORE, AFTER], ids=["imported before", "imported after"])
def program(request: pytest.FixtureRequest) -> str:
    return str(request.param) + PROGRAM


def middle(images: Iterator[bytes]) -> list[int]:
    """Return the colour (blue, green, red) in the middle of the next image."""
    data = numpy.frombuffer(next(images), numpy.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert image.shape == (40, 60, 3)
    return [int(value) for value in image[20, 30]]


def test_a_program_with_windows_runs_on_a_page(ros: RosSystem, program: str) -> None:
    ros.serve_master()
    (ros.home / "viewer.py").write_text(program)
    viewer = ros.pipros.start("python3", "viewer.py")
    with Page.of(viewer).connect() as browser:
        viewer.wait_for("^at 10$")
        windows = browser.watch("windows")
        assert next(windows) == {
            "node": "/viewer",
            "windows": [
                {"name": "view", "title": "view", "hasMouse": True, "trackbars": [["hue", 0, 179, 10]]}
            ],
        }
        images = browser.watch("image", window="view")
        assert middle(images) == pytest.approx([0, 0, 255], abs=3)

        browser.act("move", window="view", trackbar="hue", value=90)
        viewer.wait_for("^hue 90$")
        browser.act("mouse", window="view", event=cv2.EVENT_LBUTTONDOWN, x=5, y=7, flags=1)
        viewer.wait_for("^mouse 1 5 7 1 mine$")
        browser.act("key", code=ord("b"))
        assert middle(images) == pytest.approx([255, 0, 0], abs=3)
        for action, wrong in (
            ("key", {"code": "q"}),
            ("mouse", {"window": "view", "event": 99, "x": 0, "y": 0, "flags": 0}),
            ("move", {"window": "view", "trackbar": "hue", "value": 180}),
            ("move", {"window": "other", "trackbar": "hue", "value": 1}),
        ):
            assert "error" in browser.act(action, **wrong)
        browser.act("key", code=ord("q"))
        viewer.wait_for("^open 0.0$")
        viewer.wait_for("^end -1$")
    viewer.press_ctrl_c()
    assert viewer.wait() == 0


def test_ctrl_c_ends_a_program_that_waits_for_a_key(ros: RosSystem) -> None:
    ros.serve_master()
    (ros.home / "viewer.py").write_text(
        f"{BEFORE}\nimport numpy\ncv2.imshow('x', numpy.zeros((2, 2)))\nprint('up', flush=True)\n"
        "print(cv2.waitKey())"
    )
    viewer = ros.pipros.start("python3", "viewer.py")
    viewer.wait_for("^up$")
    viewer.press_ctrl_c()
    assert viewer.wait() == 0
    assert "-1" in viewer.stdout


@pytest.mark.parametrize(
    ("start", "variables"),
    [("import cv2, rospy", {}), (BEFORE, {"PIPROS_WINDOWS": "off"}), (AFTER, {"PIPROS_WINDOWS": "off"})],
    ids=["no node", "off", "off, imported after"],
)
def test_opencv_is_unchanged_without_a_node_or_if_switched_off(
    ros: RosSystem, start: str, variables: dict[str, str]
) -> None:
    ros.serve_master()
    (ros.home / "viewer.py").write_text(f"{start}\ncv2.namedWindow('x')")
    ended = ros.pipros.run("python3", "viewer.py", **variables)
    assert ended.returncode == 1
    assert "cv2.error" in ended.output
