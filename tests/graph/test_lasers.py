"""Nodes for laser scans in launch files, as users start them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.libraries.clouds.points import cloud_of
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LAUNCH = """<launch>
  <arg name="pkg"/>
  <arg name="type"/>
  <arg name="args"/>
  <node pkg="$(arg pkg)" type="$(arg type)" args="$(arg args)" name="flat">
    <remap from="cloud_in" to="/points"/>
    <param name="min_height" value="-1.0"/>
    <rosparam>{angle_min: -1.0, angle_max: 1.0, angle_increment: 0.5, range_max: 9.0}</rosparam>
  </node>
</launch>
"""


NODES = (
    ("pointcloud_to_laserscan", "pointcloud_to_laserscan_node", ""),
    ("nodelet", "nodelet", "standalone pointcloud_to_laserscan/pointcloud_to_laserscan_nodelet"),
)


@pytest.mark.parametrize("names", NODES)
def test_a_cloud_becomes_a_scan_while_it_has_subscribers(
    ros: RosSystem, tmp_path: Path, names: tuple[str, ...]
) -> None:
    (tmp_path / "flat.launch").write_text(LAUNCH)
    given = [f"{key}:={value}" for key, value in zip(("pkg", "type", "args"), names, strict=True)]
    launch = ros.pipros.start("roslaunch", tmp_path / "flat.launch", *given)
    header: Any = load_message_class("std_msgs/Header")(frame_id="lidar")
    scan: Any = load_message_class("sensor_msgs/LaserScan")
    ros.wait_for_publisher("/scan")
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        inbox = Inbox()
        points = node.advertise("/points", load_message_class("sensor_msgs/PointCloud2"), queue_size=1)
        assert not ros.subscribers("/points")
        listener = node.subscribe("/scan", scan, inbox)
        wait_until_connected(points)
        x, y, z = np.array([[2, 3], [0.1, -3], [0, 0]], np.float32)
        points.publish(cloud_of(header, {"x": x, "y": y, "z": z}))
        (made,) = inbox.wait()
        assert [round(each, 3) for each in made.ranges] == [4.243, float("inf"), 2.002, float("inf")]
        assert made.header.frame_id == "lidar"

        bad = cloud_of(header, {"x": x})
        points.publish(bad)
        launch.wait_for("field y of a cloud must exist and be of type FLOAT32")
        listener.unregister()
        wait_until(lambda: not ros.subscribers("/points"), what="the end of the subscription")
    launch.press_ctrl_c()
    assert launch.wait() == 0
