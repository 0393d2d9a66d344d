"""Image nodelets as launch files start them: a depth camera, and two cameras with a view of disparities."""

from typing import Any

import numpy as np

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
