"""The node laser_scan_matcher_node: a drive through rooms without odometry, and its inputs and outputs."""

import logging
import math
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_robot.navigation import plane
from pipros_robot.navigation.laser_matcher.icp import IcpSettings, aligned, between
from pipros_robot.navigation.laser_matcher.laser_matcher_node import LaserMatcherNode
from pipros_simulation.robots.settings import Laser
from tests.graph.unlinked import Unlinked
from tests.support import drives
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.unlinked_node import BASE, UnlinkedNode, endures, finite, message, now
from tests.support.waiting import wait_until

LOG = logging.getLogger("laser_matcher")
LOG.setLevel(logging.CRITICAL + 1)
RAYS = 180
ANGLES = replace(Laser(), rays=RAYS).increment * np.arange(RAYS)
NAME = "laser_scan_matcher_node"


@pytest.fixture
def make(unlinked: Unlinked) -> Callable[..., UnlinkedNode]:
    def made(**parameters: Any) -> UnlinkedNode:
        node = unlinked(NAME, {"base_frame": BASE, **parameters})
        LaserMatcherNode(node, LOG, None)  # type: ignore[arg-type]
        return node

    return made


def square(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, step: float = 0.05) -> Any:
    """Return the scan in a room of 4 m by 3 m, from a pose relative to its middle."""
    angles = -3.0 + step * np.arange(round(6.0 / step) + 1) + yaw
    with np.errstate(divide="ignore"):
        wide = (np.copysign(2.0, np.cos(angles)) - x) / np.cos(angles)
        high = (np.copysign(1.5, np.sin(angles)) - y) / np.sin(angles)
    made = message("sensor_msgs/LaserScan", BASE, angle_min=-3.0, angle_max=3.0, angle_increment=step,
                   range_min=0.1, range_max=9.0)  # fmt: skip
    made.ranges = np.minimum(np.abs(wide), np.abs(high)).tolist()
    return made


def pose_of(node: UnlinkedNode) -> tuple[float, ...]:
    sent = node.sent["/pose2D"][-1]
    return sent.x, sent.y, sent.theta


def test_a_drive_without_odometry_is_followed(make: Any) -> None:
    """After 25 m through five rooms, the pose is within 1 % of the way."""
    node, start, errors, way, before = make(), None, [], 0.0, None
    for moment in drives.drive(rays=RAYS):
        scan = drives.scan_message(moment)
        scan.header.frame_id = BASE
        node.give("/scan", scan)
        truth = moment.truth.x, moment.truth.y, moment.truth.yaw
        start = start or truth
        way += math.dist(truth[:2], before or truth[:2])
        before = truth[:2]
        errors.append(between(between(start, truth), pose_of(node)))  # type: ignore[arg-type]
    wrong = np.abs(errors).max(axis=0)
    assert way > 25.0
    assert math.hypot(*wrong[:2]) < 0.01 * way
    assert wrong[2] < 0.06
    (transform,) = node.sent["/tf"][-1].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("world", BASE)
    assert transform.transform.translation.x == pytest.approx(pose_of(node)[0])


def test_a_scan_fits_at_the_pose_at_which_it_was_measured() -> None:
    def points(*pose: float) -> Any:
        scan = square(*pose)
        return np.array(scan.ranges) * np.exp(1j * (scan.angle_min + scan.angle_increment * np.arange(121)))

    true = (0.2, -0.1, 0.15)
    for by_lines in (0, 1):
        settings = IcpSettings(use_point_to_line_distance=by_lines, max_iterations=50)
        found = aligned(settings, points(), points(*true), (0.1, 0.0, 0.1))
        assert found is not None
        assert found.pose == pytest.approx(true, abs=0.003 if by_lines else 0.05)
        assert (np.linalg.eigvalsh(found.covariance) > 0).all()
    assert aligned(IcpSettings(), points(), points(*true) + 20.0, (0.0, 0.0, 0.0)) is None
    assert aligned(IcpSettings(max_linear_correction=0.05), points(), points(*true), (0.1, 0.0, 0.1)) is None


@pytest.mark.parametrize("source", ["/odom", "/vel", "/imu/data"])
def test_a_motion_too_great_for_scans_alone_is_expected_from_other_sensors(make: Any, source: str) -> None:
    """Wheels and velocities predict a way of 0.6 m, an IMU a turn of 1.2 rad."""
    moved = (0.0, 0.0, 1.2) if source == "/imu/data" else (0.6, 0.3, 0.0)
    node = make(use_vel=True, max_correspondence_dist=0.15)
    for share in (0.0, 1.0):
        x, y, yaw = (share * each for each in moved)
        inputs: dict[str, Any] = {
            "/odom": message("nav_msgs/Odometry", "odom"),
            "/imu/data": message("sensor_msgs/Imu", BASE),
            "/vel": plane.twist((moved[0] / 0.5, moved[1] / 0.5, 0.0)),
        }
        pose = inputs["/odom"].pose.pose
        plane.fill(pose.position, pose.orientation, plane.raised((5.0 + x, y, yaw)))
        inputs["/imu/data"].orientation = pose.orientation
        node.give(source, inputs[source])
        scan = square(x, y, yaw)
        scan.header.stamp = now(1.0 - 0.5 * share)
        node.give("/scan", scan)
    assert pose_of(node) == pytest.approx(moved, abs=0.01)


def test_all_forms_of_the_pose_are_published_on_request(make: Any) -> None:
    names = ("pose_stamped", "pose_with_covariance", "pose_with_covariance_stamped")
    node = make(position_covariance=[1.0, 2.0, 3.0], **{f"publish_{name}": True for name in names})
    for x in (0.0, 0.1):
        node.give("/scan", square(x))
    plain, with_covariance, both = (node.sent[f"/{name}"][-1] for name in names)
    assert plain.header.frame_id == both.header.frame_id == "world"
    assert plain.pose.position.x == with_covariance.pose.position.x == both.pose.pose.position.x
    assert plain.pose.position.x == pytest.approx(0.1, abs=0.005)
    assert list(both.pose.covariance[:15:7]) == list(with_covariance.covariance[:15:7]) == [1.0, 2.0, 3.0]


def test_a_cloud_is_matched_instead_of_a_scan(make: Any) -> None:
    node = make(use_cloud_input=True, cloud_res=0.02)
    assert "/scan" not in node.inputs
    for x in (0.0, 0.08):
        scan = square(x, 0.0, 0.0)
        angles = scan.angle_min + scan.angle_increment * np.arange(121)
        values = np.stack((scan.ranges * np.cos(angles), scan.ranges * np.sin(angles), np.zeros(121)), 1)
        node.give("/cloud", plane.cloud(("x", "y", "z"), values, BASE, now()))
    assert pose_of(node) == pytest.approx((0.08, 0.0, 0.0), abs=0.01)


@pytest.mark.parametrize("topic", ["/scan", "/odom", "/imu/data", "/cloud", "/vel"])
def test_edge_values_do_not_end_the_matching(make: Any, topic: str) -> None:
    node = make(use_cloud_input=topic == "/cloud", use_vel=True)
    source = "/cloud" if topic == "/cloud" else "/scan"

    def cloud() -> Any:
        points = np.random.default_rng(1).uniform(-3, 3, (50, 3))
        made = plane.cloud(("x", "y", "z"), points, BASE, now())
        made.data = bytes(made.data)
        return made

    def odometry() -> Any:
        made = message("nav_msgs/Odometry", "odom")
        made.pose.pose.orientation.w = 1.0
        return made

    def imu() -> Any:
        made = message("sensor_msgs/Imu", BASE)
        made.orientation.w = 1.0
        return made

    good: dict[str, Any] = {"/scan": square, "/odom": odometry, "/imu/data": imu, "/cloud": cloud,
                            "/vel": lambda: plane.twist((0.0, 0.0, 0.0))}  # fmt: skip

    def has_effect() -> bool:
        before = len(node.sent["/pose2D"])
        for _ in range(2):
            node.give(topic, good[topic]())
            node.give(source, good[source]())
        return len(node.sent["/pose2D"]) > before and finite(node.sent["/pose2D"][-1])

    with np.errstate(all="ignore"):
        endures(node, topic, good[topic], has_effect)


def test_the_program_publishes_poses(ros: RosSystem) -> None:
    ros.serve_master()
    process = ros.pipros.start("rosrun", "laser_scan_matcher", NAME, f"_base_frame:={BASE}")
    found = Inbox()
    with Node("robot", environment=Environment(master_uri=ros.master_uri)) as robot:
        robot.subscribe("/pose2D", load_message_class("geometry_msgs/Pose2D"), found)
        scans = robot.advertise("/scan", load_message_class("sensor_msgs/LaserScan"), queue_size=5)
        wait_until_connected(scans)

        def is_matched() -> bool:
            scans.publish(square())
            return len(found.messages) > 1

        wait_until(is_matched, 30)
    assert found.messages[-1].x == pytest.approx(0.0, abs=1e-6)
    process.press_ctrl_c()
    assert process.wait() == 0


def test_scans_with_thousands_of_beams_take_little_memory(make: Any) -> None:
    node = make()
    tracemalloc.start()
    for x in (0.0, 0.2):
        node.give("/scan", square(x, step=0.001))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert pose_of(node) == pytest.approx((0.2, 0.0, 0.0), abs=0.02)
    assert peak < 400_000_000
