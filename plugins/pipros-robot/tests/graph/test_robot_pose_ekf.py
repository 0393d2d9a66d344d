"""The node robot_pose_ekf: a drive with drifting wheels and an IMU, and its status."""

import logging
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_robot.navigation import plane
from pipros_robot.navigation.pose_ekf.pose_ekf_node import PoseEkfNode
from tests.graph.unlinked import Unlinked
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.unlinked_node import Cycles, UnlinkedNode, endures, finite, message, now, variances
from tests.support.waiting import wait_until

LOG = logging.getLogger("pose_ekf")
LOG.setLevel(logging.CRITICAL + 1)
PERIOD_S, RADIUS_M, TURN = 0.1, 2.0, 0.5
STEPS = round(math.tau / TURN / PERIOD_S)


@pytest.fixture
def make(unlinked: Unlinked) -> Callable[..., tuple[UnlinkedNode, Cycles]]:
    def made(**parameters: Any) -> tuple[UnlinkedNode, Cycles]:
        node, cycles = unlinked("robot_pose_ekf", parameters), Cycles()
        PoseEkfNode(node, LOG, cycles)  # type: ignore[arg-type]
        return node, cycles

    return made


def odometry(x: float = 1.0, y: float = 0.0, yaw: float = 0.0, z: float = 0.0) -> Any:
    made = message("nav_msgs/Odometry", "odom")
    plane.fill(made.pose.pose.position, made.pose.pose.orientation, plane.raised((x, y, yaw)))
    made.pose.pose.position.z = z
    made.pose.covariance = variances(1e-3)
    return made


def imu(yaw: float = 0.0) -> Any:
    made = message("sensor_msgs/Imu", "base_footprint")
    plane.fill(load_message_class("geometry_msgs/Point")(), made.orientation, plane.raised((0.0, 0.0, yaw)))
    made.orientation_covariance = [1e-6, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 1e-6]
    return made


def drive(node: UnlinkedNode, cycles: Cycles, *, has_imu: bool) -> tuple[float, ...]:
    """Drive in a circle with wheels that turn 10 % too far. Return the estimated pose."""
    for step in range(STEPS):
        stamp = now((STEPS - step) * PERIOD_S)
        true, wrong = TURN * PERIOD_S * step, 1.1 * TURN * PERIOD_S * step
        radius = RADIUS_M / 1.1
        wheels = odometry(radius * math.sin(wrong), radius * (1 - math.cos(wrong)), wrong)
        for topic, made in (("/odom", wheels), ("/imu_data", imu(0.7 + true)))[: 1 + has_imu]:
            made.header.stamp = stamp
            node.give(topic, made)
        cycles.cycle()
    sent = node.sent["/robot_pose_ekf/odom_combined"][-1]
    return plane.flat_message(sent.pose.pose)


def test_the_yaw_of_an_imu_corrects_that_of_the_wheels(make: Any) -> None:
    x, y, yaw = drive(*make(vo_used=False, sensor_timeout=100.0), has_imu=True)
    assert math.hypot(x, y) < 0.1
    assert abs(math.remainder(yaw, math.tau)) < 0.1


def test_without_an_imu_the_pose_is_that_of_the_wheels(make: Any) -> None:
    found = drive(*make(vo_used=False, imu_used=False, sensor_timeout=100.0), has_imu=False)
    wrong = 1.1 * TURN * PERIOD_S * (STEPS - 1)
    radius = RADIUS_M / 1.1
    wheels = radius * math.sin(wrong), radius * (1 - math.cos(wrong)), math.remainder(wrong, math.tau)
    assert found == pytest.approx(wheels, abs=1e-6)


def test_the_estimate_starts_at_the_first_pose_of_the_wheels_in_the_given_frames(make: Any) -> None:
    node, cycles = make(vo_used=False, output_frame="odom", base_footprint_frame="base_link", imu_used=False)
    cycles.cycle()
    assert not node.sent["/robot_pose_ekf/odom_combined"]
    for ago_s in (1.0, 0.9):
        given = odometry(3.0, -2.0, 1.0, z=5.0)
        given.header.stamp = now(ago_s)
        node.give("/odom", given)
        cycles.cycle()
    sent = node.sent["/robot_pose_ekf/odom_combined"][-1]
    assert plane.flat_message(sent.pose.pose) == pytest.approx((3.0, -2.0, 1.0), abs=0.01)
    assert sent.pose.pose.position.z == pytest.approx(0.0, abs=1e-3)
    (transform,) = node.sent["/tf"][-1].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("odom", "base_link")


def test_a_camera_measures_the_height_and_a_satellite_receiver_the_place(make: Any) -> None:
    node, cycles = make(odom_used=False, imu_used=False, gps_used=True, sensor_timeout=100.0)
    for step in range(50):
        for topic, given in (("/vo", odometry(0.0, 0.0, 0.0, z=0.1 * step)), ("/gps", odometry(7.0, 8.0))):
            given.pose.covariance = variances(1e-3 if topic == "/vo" else 10.0)
            given.header.stamp = now(5.0 - 0.1 * step)
            node.give(topic, given)
        cycles.cycle()
    place = node.sent["/robot_pose_ekf/odom_combined"][-1].pose.pose.position
    assert place.z > 1.0
    assert (place.x, place.y) == pytest.approx((7.0, 8.0), abs=0.5)


@pytest.mark.parametrize("topic", ["/odom", "/imu_data", "/vo"])
def test_edge_values_do_not_end_the_filter(make: Any, topic: str) -> None:
    node, cycles = make()
    inputs: dict[str, Any] = {"/odom": odometry, "/imu_data": imu, "/vo": odometry}
    sent = node.sent["/robot_pose_ekf/odom_combined"]

    def has_effect() -> bool:
        before = len(sent)
        for _ in range(3):
            for name, good in inputs.items():
                node.give(name, good())
            cycles.cycle()
            if len(sent) > before:
                return finite(sent[-1])
        return False

    with np.errstate(all="ignore"):
        endures(node, topic, inputs[topic], has_effect)


def test_the_program_answers_its_status(ros: RosSystem) -> None:
    ros.serve_master()
    process = ros.pipros.start("rosrun", "robot_pose_ekf", "robot_pose_ekf", "_vo_used:=false", "_freq:=20.0")
    service: Any = load_service_class("robot_pose_ekf/GetStatus")
    found = Inbox()
    with Node("robot", environment=Environment(master_uri=ros.master_uri)) as robot:
        robot.subscribe(
            "/robot_pose_ekf/odom_combined",
            load_message_class("geometry_msgs/PoseWithCovarianceStamped"),
            found,
        )
        wheels = robot.advertise("/odom", load_message_class("nav_msgs/Odometry"), queue_size=5)
        client = robot.client("/robot_pose_ekf/get_status", service)
        wait_until_connected(wheels)
        client.wait_until_available(60, pause=time.sleep, report=lambda _: None)
        assert "waits for the first measurements" in client.call(service._request_class(), 60).status

        def is_estimated() -> bool:
            wheels.publish(odometry(2.0))
            return bool(found.messages)

        wait_until(is_estimated, 30)
        status = client.call(service._request_class(), 60).status
    assert "filter: running" in status
    assert "vo (/vo): not used" in status
    assert found.messages[-1].pose.pose.position.x == pytest.approx(2.0, abs=0.1)
    process.press_ctrl_c()
    assert process.wait() == 0
