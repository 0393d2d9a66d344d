"""Nodes for laser scans in launch files, as users start them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_robot.perception.clouds.pcd import formatted, parse
from pipros_robot.perception.clouds.points import cloud_of, positions, rows_of
from tests.support.bags import Row, bag_bytes
from tests.support.environments import file_of_tests
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


# Launch files for clouds and lasers as courses write them, started for real and fed from a bag.


PACKAGE = file_of_tests("packages/cloud_launches")
SCAN, CLOUD = "sensor_msgs/LaserScan", "sensor_msgs/PointCloud2"
OUTPUTS = {
    "/velodyne_scan": SCAN, "/downsampled": CLOUD, "/region/box/output": CLOUD,
    "/objects/clusters/output": CLOUD, "/objects/floor/model": "pcl_msgs/ModelCoefficients",
    "/map_cloud": CLOUD, "/scan_filtered": SCAN,
    "/laser_points": CLOUD, "/kinect_scan": SCAN, "/one/scan_filtered": SCAN, "/one/cloud_scan": SCAN,
}  # fmt: skip


def room() -> Any:
    """Return the points that a lidar 0.8 m above the floor sees: the floor, a wall at 5 m and two boxes."""
    numbers = np.random.default_rng(1)
    floor = np.stack([*numbers.uniform(-5, 5, (2, 4000)), np.full(4000, -0.8)], 1)
    wall = np.stack([np.full(1500, 5.0), numbers.uniform(-5, 5, 1500), numbers.uniform(-0.5, 2, 1500)], 1)
    boxes = [numbers.uniform((x, y, -0.5), (x + 0.4, y + 0.4, 0.5), (300, 3)) for x, y in ((2, 0), (-2, 3))]
    return np.concatenate([floor, wall, *boxes]).astype(np.float32)


def moment(index: int) -> list[Row]:
    """Return the messages of one moment: a cloud, a scan, and a depth image with its camera."""
    header: Any = load_message_class("std_msgs/Header")(stamp=Time(100, index * 10**8))

    def made(type_name: str, frame: str) -> Any:
        message: Any = load_message_class(type_name)()
        message.header.stamp, message.header.frame_id = header.stamp, frame
        return message

    cloud = cloud_of(made(CLOUD, "velodyne").header, dict(zip("xyz", room().T, strict=True)), 16)
    scan = made(SCAN, "velodyne")
    scan.angle_min, scan.angle_increment, scan.range_max, scan.ranges = (
        -0.5, 0.01, 30.0, [2.0] * 90 + [9.0] * 10,
    )  # fmt: skip
    image, info = made("sensor_msgs/Image", "camera"), made("sensor_msgs/CameraInfo", "camera")
    image.height, image.width, image.encoding, image.step = 48, 64, "16UC1", 128
    image.data = np.full((48, 64), 1500, np.uint16).tobytes()
    info.K, info.R = [60, 0, 32, 0, 60, 24, 0, 0, 1], [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [60, 0, 32, 0, 0, 60, 24, 0, 0, 0, 1, 0]
    topics = {
        "/velodyne_points": cloud, "/scan": scan,
        "/camera/depth/image_raw": image, "/camera/depth/camera_info": info,
    }  # fmt: skip
    return [(topic, message, 100, index * 10**8) for topic, message in topics.items()]


def test_launch_files_for_clouds_and_lasers_run_from_a_bag(ros: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "drive.bag").write_bytes(bag_bytes(row for index in range(5) for row in moment(index)))
    (tmp_path / "map.pcd").write_bytes(formatted(moment(0)[0][1], "binary_compressed"))
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(PACKAGE)
    files = sorted((PACKAGE / "launch").glob("*.launch"))
    launch = ros.pipros.start("roslaunch", *files, f"file:={tmp_path / 'map.pcd'}", f"folder:={tmp_path}")
    for topic in OUTPUTS:
        ros.wait_for_publisher(topic)
    inboxes = {topic: Inbox() for topic in OUTPUTS}
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        for topic, type_name in OUTPUTS.items():
            node.subscribe(topic, load_message_class(type_name), inboxes[topic])
        bag = ros.pipros.start("rosbag", "play", "--loop", "--quiet", tmp_path / "drive.bag")

        def all_react() -> bool:
            clusters = {each.width for each in inboxes["/objects/clusters/output"].messages}
            is_saved = (tmp_path / "saved.pcd").exists()
            return all(each.messages for each in inboxes.values()) and {300, 1500} <= clusters and is_saved

        wait_until(
            all_react,
            60,
            lambda: f"{[topic for topic, each in inboxes.items() if not each.messages]} {launch.output}",
        )
        got = {topic: each.messages[-1] for topic, each in inboxes.items()}
        service: Any = load_service_class("laser_assembler/AssembleScans2")
        request = service._request_class(Time(0, 0), Time(200, 0))
        assembled = node.client("/assemble_scans2", service).call(request).cloud
        bag.press_ctrl_c()
    check(got)
    assert assembled.width >= 80
    saved = wait_until(lambda: complete(tmp_path / "saved.pcd"))
    assert saved.width == len(room())
    launch.press_ctrl_c()
    assert launch.wait() == 0


def complete(path: Path) -> Any:
    try:
        return parse(path.read_bytes())[0]
    except ValueError:
        return None


def check(got: dict[str, Any]) -> None:
    """Check what the nodes made of the room."""
    scan = got["/velodyne_scan"]
    assert scan.header.frame_id == "base_link"
    ahead = min(scan.ranges[150:165])
    assert 1.9 < ahead < 2.2
    assert 4.8 < min(scan.ranges[180:190]) < 6.5
    assert 200 < got["/downsampled"].width < 2000
    box = positions(got["/region/box/output"], rows_of(got["/region/box/output"]))
    assert (box[:, 0] >= 0).all()
    assert (np.abs(box[:, 1]) <= 2).all()
    _, _, c, d = got["/objects/floor/model"].values
    assert abs(c) > 0.99
    assert abs(abs(d) - 0.8) < 0.02
    assert (got["/map_cloud"].header.frame_id, got["/map_cloud"].width) == ("map", len(room()))
    assert got["/scan_filtered"].ranges[-1] == float("inf")
    points = positions(got["/laser_points"], rows_of(got["/laser_points"]))
    assert np.allclose(np.hypot(points[:, 0], points[:, 1]), 2.0, atol=0.05)
    assert abs(np.nanmin(got["/kinect_scan"].ranges) - 1.5) < 1e-5
    assert abs(np.nanmin(got["/one/scan_filtered"].ranges) - 1.5) < 1e-5
    assert 1.9 < min(got["/one/cloud_scan"].ranges[180:185]) < 2.5
