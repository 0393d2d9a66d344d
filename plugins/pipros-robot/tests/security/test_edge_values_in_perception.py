"""Nodelets for images, clouds and scans, and simulated robots, endure edge values in any field of any input.

As in `test_edge_values_in_messages`, callbacks are called directly, so that an exception fails the test.
"""

import logging
import time
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipros.packages.nodelets import python_nodelet, shipped_nodelets
from pipros_robot.perception.clouds.points import cloud_of
from pipros_robot.perception.imu.nodes import ComplementaryNode
from pipros_robot.perception.laser.assembler_node import LaserScanAssembler
from pipros_simulation.fake_localization import FakeLocalization
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.robots_node import RobotsNode
from pipros_simulation.robots.settings import RobotSettings
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.world import World
from pipros_simulation.turtlesim.turtlesim_node import Turtlesim
from tests.graph.unlinked import Unlinked
from tests.support.unlinked_node import UnlinkedNode, endures, finite, message, now, posed, scan, transforms

Inputs = Mapping[str, Callable[[], Any]]

ROUNDS = 8
"""The most good messages for each input after an edge message until there is an output again."""

SIZE = 48
"""The rows and columns of images."""

FRAME = "camera"


def image(encoding: str = "mono8") -> Any:
    pixel = {"mono8": "<u1", "rgb8": "3<u1", "bayer_rggb8": "<u1", "16UC1": "<u2", "32FC1": "<f4"}[encoding]
    pixels = np.ones((SIZE, SIZE), pixel)
    return message("sensor_msgs/Image", FRAME, height=SIZE, width=SIZE, encoding=encoding,
                   step=pixels.strides[0], data=pixels.tobytes())  # fmt: skip


def info(baseline: float = 0.0) -> Any:
    made = message("sensor_msgs/CameraInfo", FRAME, height=SIZE, width=SIZE, distortion_model="plumb_bob")
    made.D = [0.1, 0.0, 0.0, 0.0, 0.0]
    made.K = [50.0, 0.0, 24.0, 0.0, 50.0, 24.0, 0.0, 0.0, 1.0]
    made.R = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    made.P = [50.0, 0.0, 24.0, -50.0 * baseline, 0.0, 50.0, 24.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    return made


def disparities() -> Any:
    made = message("stereo_msgs/DisparityImage", FRAME, f=50.0, T=0.1, min_disparity=1.0, max_disparity=64.0)
    made.image = image("32FC1")
    made.delta_d = 0.0625
    return made


def cloud() -> Any:
    axis = np.linspace(0.1, 0.9, 60, dtype=np.float32)
    made = cloud_of(message("sensor_msgs/Image", FRAME).header, {"x": axis, "y": axis * 0.1, "z": axis * 0.0})
    made.data = bytes(made.data)
    return made


def indices() -> Any:
    return message("pcl_msgs/PointIndices", FRAME, indices=list(range(20)))


def command() -> Any:
    made = message("geometry_msgs/Twist")
    made.linear.x = 0.5
    return made


def odometry() -> Any:
    made = message("nav_msgs/Odometry", "odom", child_frame_id="base_link")
    made.pose.pose.orientation.w = 1.0
    return made


def imu() -> Any:
    made = message("sensor_msgs/Imu", FRAME)
    made.linear_acceleration.z, made.angular_velocity.z = 9.8, 0.1
    return made


def field() -> Any:
    made = message("sensor_msgs/MagneticField", FRAME)
    made.magnetic_field.x, made.magnetic_field.z = 2e-5, -4e-5
    return made


IMAGE = {"/image_raw": image}
CLOUD = {"/nodelet/input": cloud}
CHAIN = {"scan_filter_chain": [
    {"name": "range", "type": "laser_filters/LaserScanRangeFilter", "params": {"lower_threshold": 0.2}},
    {"name": "shadows", "type": "laser_filters/ScanShadowsFilter",
     "params": {"min_angle": 10, "max_angle": 170, "neighbors": 2, "window": 1}},
    {"name": "median", "type": "laser_filters/LaserArrayFilter", "params": {
        "range_filter_chain": [{"name": "m", "type": "filters/MultiChannelMedianFilterFloat",
                                "params": {"number_of_observations": 3}}]}},
    {"name": "speckle", "type": "laser_filters/LaserScanSpeckleFilter",
     "params": {"filter_type": 0, "max_range": 2.0, "max_range_difference": 0.1, "filter_window": 2}},
    {"name": "interpolation", "type": "laser_filters/InterpolationFilter"},
]}  # fmt: skip

MUX = "publisher: cmd_vel\nsubscribers: [{name: a, topic: in, timeout: 1, priority: 1}]"

NODELETS: Mapping[str, tuple[Inputs, str, Mapping[str, Any]]] = {
    "depth_image_proc/convert_metric": ({"/image_raw": partial(image, "16UC1")}, "/image", {}),
    "depth_image_proc/point_cloud_xyz": (
        {"/image_rect": partial(image, "16UC1"), "/camera_info": info}, "/points", {}),
    "depth_image_proc/point_cloud_xyzrgb": (
        {"/depth_registered/image_rect": partial(image, "32FC1"), "/rgb/camera_info": info,
         "/rgb/image_rect_color": partial(image, "rgb8")}, "/depth_registered/points", {}),
    "depth_image_proc/register": (
        {"/depth/image_rect": partial(image, "16UC1"), "/depth/camera_info": info, "/rgb/camera_info": info},
        "/depth_registered/image_rect", {}),
    "depthimage_to_laserscan/DepthImageToLaserScanNodelet": (
        {"/image": partial(image, "16UC1"), "/camera_info": info}, "/scan", {}),
    "image_proc/debayer": ({"/image_raw": partial(image, "bayer_rggb8")}, "/image_color", {}),
    "image_proc/rectify": ({"/image_mono": image, "/camera_info": info}, "/image_rect", {}),
    "imu_filter_madgwick/ImuFilterNodelet": (
        {"/imu/data_raw": imu, "/imu/mag": field}, "/imu/data", {"zeta": 0.1}),
    "kobuki_safety_controller/SafetyControllerNodelet": (
        {"/nodelet/events/cliff": partial(message, "kobuki_msgs/CliffEvent", state=1),
         "/nodelet/events/wheel_drop": partial(message, "kobuki_msgs/WheelDropEvent"),
         "/nodelet/events/bumper": partial(message, "kobuki_msgs/BumperEvent", state=1)},
        "/nodelet/cmd_vel", {}),
    "laser_filters/scan_to_cloud_filter_chain": (
        {"/scan": scan}, "/cloud_filtered", {**CHAIN, "target_frame": "base_footprint"}),
    "laser_filters/scan_to_scan_filter_chain": ({"/scan": scan}, "/scan_filtered", CHAIN),
    "pcl/CropBox": (CLOUD, "/nodelet/output", {"input_frame": "base_footprint"}),
    "pcl/EuclideanClusterExtraction": (
        CLOUD, "/nodelet/output", {"cluster_tolerance": 0.1, "spatial_locator": 0}),
    "pcl/ExtractIndices": ({**CLOUD, "/nodelet/indices": indices}, "/nodelet/output", {}),
    "pcl/PassThrough": (CLOUD, "/nodelet/output", {}),
    "pcl/SACSegmentation": (
        {**CLOUD, "/nodelet/indices": indices}, "/nodelet/model",
        {"model_type": 0, "distance_threshold": 0.1, "use_indices": True}),
    "pcl/StatisticalOutlierRemoval": (CLOUD, "/nodelet/output", {}),
    "pcl/VoxelGrid": (CLOUD, "/nodelet/output", {"leaf_size": 0.1}),
    "pointcloud_to_laserscan/pointcloud_to_laserscan_nodelet": (
        {"/cloud_in": cloud}, "/scan", {"target_frame": "base_footprint"}),
    "stereo_image_proc/disparity": (
        {"/left/image_rect": image, "/left/camera_info": info, "/right/image_rect": image,
         "/right/camera_info": partial(info, 0.1)}, "/disparity", {}),
    "stereo_image_proc/point_cloud2": (
        {"/left/image_rect_color": partial(image, "rgb8"), "/left/camera_info": info,
         "/right/camera_info": partial(info, 0.1), "/disparity": disparities}, "/points2", {}),
    "yocs_cmd_vel_mux/CmdVelMuxNodelet": (
        {"/nodelet/in": command}, "/nodelet/cmd_vel",
        {"yaml_cfg_data": MUX}),
    "yocs_velocity_smoother/VelocitySmootherNodelet": (
        {"/nodelet/raw_cmd_vel": command, "/nodelet/odometry": odometry},
        "/nodelet/smooth_cmd_vel", {"robot_feedback": 1, "frequency": 1000.0}),
}  # fmt: skip
"""Good inputs of each nodelet, an output, and the private parameters."""


@pytest.fixture
def make(unlinked: Unlinked) -> Callable[..., UnlinkedNode]:
    def made(parameters: Mapping[str, Any]) -> UnlinkedNode:
        node = unlinked("nodelet", parameters)
        node.log.setLevel(logging.CRITICAL + 1)
        return node

    return made


def has_effect(node: UnlinkedNode, inputs: Inputs, output: str) -> bool:
    """Give good messages with equal timestamps to all inputs, until there is an output."""
    sent = node.sent[output]
    before = len(sent)
    for _ in range(ROUNDS):
        stamp = now()
        if "/tf" in node.inputs:
            for child in ("laser", FRAME):
                node.give("/tf", transforms("base_footprint", child))
        for topic, good in inputs.items():
            made = good()
            if hasattr(made, "header"):
                made.header.stamp = stamp
            node.give(topic, made)
        if output.endswith("cmd_vel"):
            time.sleep(0.005)  # commands are sent periodically
        if len(sent) > before:
            return not output.endswith("cmd_vel") or finite(sent[-1])
    return False


@pytest.mark.parametrize("plugin", sorted(shipped_nodelets()))
def test_a_nodelet_goes_on(make: Any, plugin: str) -> None:
    assert plugin in NODELETS, "add it to NODELETS"
    inputs, output, parameters = NODELETS[plugin]
    node = make(parameters)
    module, _, name = str(python_nodelet(plugin)).partition(":")
    nodelet = getattr(import_module(module), name)(node)
    for topic, good in inputs.items():
        endures(node, topic, good, lambda: has_effect(node, inputs, output))
    getattr(nodelet, "close", lambda: None)()


def test_a_complementary_filter_goes_on(make: Any) -> None:
    inputs: Inputs = {"/imu/data_raw": imu, "/imu/mag": field}
    node = make({"use_mag": True})
    one = ComplementaryNode(node)
    for topic, good in inputs.items():
        endures(node, topic, good, lambda: has_effect(node, inputs, "/imu/data"))
    assert finite(node.sent["/imu/data"][-1])
    one.close()


@pytest.mark.parametrize("is_moving", [True, False])
def test_an_assembler_of_scans_goes_on(make: Any, is_moving: bool) -> None:
    node = make({"fixed_frame": "base_footprint", "max_scans": 10, "ignore_laser_skew": not is_moving})
    LaserScanAssembler(node)

    def assembles() -> bool:
        first = now()
        node.give("/tf", transforms("base_footprint", "laser"))
        measured = scan()
        measured.header.frame_id = "laser"
        node.give("/scan", measured)
        node.give("/tf", transforms("base_footprint", "laser"))
        request = SimpleNamespace(begin=first, end=now())
        return len(node.services["assemble_scans"](request).cloud.points) >= len(scan().ranges)

    endures(node, "/scan", scan, assembles)


@pytest.mark.parametrize("topic", ["/base_pose_ground_truth", "/initialpose", "/tf"])
def test_fake_localization_goes_on(make: Any, topic: str) -> None:
    node = make({})
    node.loops_back = False
    FakeLocalization(node)
    inputs: Inputs = {
        "/base_pose_ground_truth": odometry,
        "/initialpose": partial(posed, "map"),
        "/tf": partial(transforms, "odom", "base_link"),
    }

    def localizes() -> bool:
        before = len(node.sent["/amcl_pose"])
        for _ in range(2):
            node.give("/tf", transforms("odom", "base_link"))
            node.give("/initialpose", posed("map"))
            node.give("/base_pose_ground_truth", odometry())
            node.give("/tf", transforms("odom", "base_link"))
        sent = node.sent["/amcl_pose"]
        return len(sent) > before and finite(sent[-1])

    endures(node, topic, inputs[topic], localizes)


HALL = World.from_cells(np.zeros((400, 400), np.bool_), 0.05)
"""A hall without walls, in which a robot drives a few seconds."""


def test_a_simulated_robot_goes_on(make: Any) -> None:
    node = make({})
    simulated = RobotsNode(node, Simulation(HALL, [RobotSettings()]))

    def drives() -> bool:
        node.give("/cmd_vel", command())
        for _ in range(10):
            simulated.step()
        simulated.simulation.place("", Pose(10.0, 10.0, 0.0))
        sent = node.sent["/odom"][-1]
        return finite(sent) and sent.twist.twist.linear.x > 0

    endures(node, "/cmd_vel", command, drives)


def test_a_turtle_goes_on(make: Any) -> None:
    turtlesim = Turtlesim(node := make({}), node.log)

    def drives() -> bool:
        node.give("/turtle1/cmd_vel", command())
        with turtlesim.lock:
            turtlesim.world.tick(time.monotonic())
        pose = turtlesim.world.turtles["turtle1"].pose
        return finite([pose.x, pose.y, pose.theta]) and pose.linear_velocity == 0.5

    endures(node, "/turtle1/cmd_vel", command, drives)
