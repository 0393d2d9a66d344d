"""Nodes for laser scans in launch files, as users start them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_robot.perception.clouds.points import cloud_of
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


CHAIN = """<launch>
  <node pkg="laser_filters" type="scan_to_scan_filter_chain" name="chain">
    <rosparam>
      scan_filter_chain:
      - {name: near, type: laser_filters/LaserScanRangeFilter, params: {upper_threshold: 3.0}}
      - name: door
        type: laser_filters/LaserScanPolygonFilter
        params: {polygon_frame: laser, polygon: [[1, -1], [3, -1], [3, 1], [1, 1]]}
    </rosparam>
  </node>
  <node pkg="laser_assembler" type="laser_scan_assembler" name="assembler" output="screen">
    <remap from="scan" to="scan_filtered"/>
    <rosparam>{fixed_frame: laser, max_scans: 3}</rosparam>
  </node>
</launch>
"""


def test_clients_change_the_filters_of_a_running_chain(ros: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "chain.launch").write_text(CHAIN)
    launch = ros.pipros.start("roslaunch", tmp_path / "chain.launch")
    scan: Any = load_message_class("sensor_msgs/LaserScan")()
    scan.header.frame_id, scan.range_max, scan.angle_increment = "laser", 10.0, 0.5
    scan.ranges = [2.0, 2.5, 4.0]
    service: Any = load_service_class("dynamic_reconfigure/Reconfigure")
    ros.wait_for_publisher("/scan_filtered")
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        filtered, shown = Inbox(), Inbox()
        scans = node.advertise("/scan", type(scan), queue_size=9)
        wait_until_connected(node.subscribe("/scan_filtered", type(scan), filtered))
        node.subscribe("/chain/door/polygon", load_message_class("geometry_msgs/PolygonStamped"), shown)
        wait_until_connected(scans)
        ros.wait_for_links("/scan_filtered", 2)  # also the assembler's
        scans.publish(scan)
        ranges = filtered.wait()[0].ranges
        assert np.array_equal(ranges, [np.nan, 2.5, 100000.0], equal_nan=True)
        corner = shown.wait()[0].polygon.points[0]
        assert (corner.x, corner.y) == (1, -1)

        for name, field, key, value in (
            ("near", "doubles", "upper_threshold", 2.2),
            ("door", "strs", "polygon", "[[0, 1], [5, 1], [5, 5], [0, 5]]"),
            ("door", "strs", "polygon", "nonsense"),
        ):
            request = service._request_class()
            kind: Any = load_message_class(f"dynamic_reconfigure/{field[:-1].capitalize()}Parameter")
            getattr(request.config, field).append(kind(key, value))
            node.client(f"/chain/{name}/set_parameters", service).call(request)
        scans.publish(scan)
        assert np.array_equal(filtered.wait(2)[1].ranges, [2.0, 100000.0, 100000.0], equal_nan=True)

        assemble: Any = load_service_class("laser_assembler/AssembleScans2")
        request = assemble._request_class()
        request.end.secs = 1
        client = node.client("/assemble_scans2", assemble)
        wait_until(lambda: client.call(request).cloud.width == 2, what="two points")
    launch.press_ctrl_c()
    assert launch.wait() == 0
