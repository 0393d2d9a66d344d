"""The nodes of imu_filter_madgwick and imu_complementary_filter."""

import logging
import math
from collections.abc import Callable
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_robot.perception.imu.nodes import ComplementaryNode, MadgwickNode
from tests.graph.unlinked import Unlinked
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.unlinked_node import UnlinkedNode, message
from tests.support.waiting import wait_until

GRAVITY = 9.80665

Make = Callable[..., UnlinkedNode]


@pytest.fixture
def make(unlinked: Unlinked) -> Make:
    def made(**parameters: Any) -> UnlinkedNode:
        node = unlinked("imu_filter", parameters)
        node.log.setLevel(logging.CRITICAL + 1)
        return node

    return made


def imu(pitch: float = 0.0, rate: float = 0.0) -> Any:
    made = message("sensor_msgs/Imu", "imu_link")
    made.linear_acceleration.x = -math.sin(pitch) * GRAVITY
    made.linear_acceleration.z = math.cos(pitch) * GRAVITY
    made.angular_velocity.z = rate
    return made


def field(x: float, y: float, z: float = -0.3) -> Any:
    made = message("sensor_msgs/MagneticField", "imu_link")
    made.magnetic_field.x, made.magnetic_field.y, made.magnetic_field.z = x, y, z
    return made


def yaw_of(orientation: Any) -> float:
    return 2 * math.atan2(orientation.z, orientation.w)


def test_madgwick_publishes_the_orientation_without_gravity_and_transforms(make: Make) -> None:
    node = make(use_mag=False, remove_gravity_vector=True, orientation_stddev=0.2, yaw_offset=0.5,
                declination=0.2, fixed_frame="world", reverse_tf=True)  # fmt: skip
    one = MadgwickNode(node)
    node.give("/imu/data_raw", imu(pitch=0.0))
    (found,) = node.sent["/imu/data"]
    assert yaw_of(found.orientation) == pytest.approx(0.3)
    assert found.orientation_covariance == pytest.approx([0.04, 0, 0, 0, 0.04, 0, 0, 0, 0.04])
    assert found.linear_acceleration.z == pytest.approx(0.0, abs=1e-9)
    ((transform,),) = (each.transforms for each in node.sent["/tf"])
    assert (transform.header.frame_id, transform.child_frame_id) == ("imu_link", "world")
    assert yaw_of(transform.transform.rotation) == pytest.approx(-0.3)
    one.close()


def test_madgwick_waits_for_the_magnetic_field_and_subtracts_its_bias(make: Make) -> None:
    node = make(mag_bias_x=0.1, publish_debug_topics=True, publish_tf=False)
    one = MadgwickNode(node)
    node.give("/imu/data_raw", imu())
    assert not node.sent["/imu/data"]
    node.give("/imu/mag", field(0.5, 0.0))
    assert yaw_of(node.sent["/imu/data"][-1].orientation) == pytest.approx(math.pi / 2)
    for topic in ("/imu/rpy/filtered", "/imu/rpy/raw"):
        assert node.sent[topic][-1].vector.z == pytest.approx(math.pi / 2)
    assert "/tf" not in node.sent
    one.close()


def test_a_stateless_filter_forgets_the_last_orientation(make: Make) -> None:
    node = make(stateless=True)
    one = MadgwickNode(node)
    for x, y, yaw in ((0.4, 0.0, math.pi / 2), (0.0, 0.4, 0.0), (0.0, -0.4, math.pi)):
        node.give("/imu/data_raw", imu(rate=5.0))
        node.give("/imu/mag", field(x, y))
        assert math.cos(yaw_of(node.sent["/imu/data"][-1].orientation) - yaw) == pytest.approx(1.0)
    one.close()


def test_an_unknown_world_frame_and_a_negative_time_step_have_their_defaults(make: Make) -> None:
    node = make(world_frame="up", constant_dt=-1.0)
    one = MadgwickNode(node)
    node.give("/imu/data_raw", imu())
    node.give("/imu/mag", field(0.0, 0.4))
    assert yaw_of(node.sent["/imu/data"][-1].orientation) == pytest.approx(0.0, abs=1e-6)
    one.close()


def test_measurements_of_any_size_are_dropped_or_have_finite_results(make: Make) -> None:
    node = make(use_mag=False, constant_dt=0.1, gain=0.0)
    one = MadgwickNode(node)
    for rate in (0.1, math.nan, 1e300, 0.1):
        node.give("/imu/data_raw", imu(rate=rate))
    assert [yaw_of(each.orientation) for each in node.sent["/imu/data"]] == pytest.approx([0.01, 0.02], 1e-3)
    one.close()


def test_the_complementary_filter_removes_the_bias_and_says_whether_the_imu_rests(make: Make) -> None:
    node = make(constant_dt=0.01, bias_alpha=0.5, publish_debug_topics=True, gain_acc=7.0, publish_tf=True)
    one = ComplementaryNode(node)
    for _ in range(50):
        node.give("/imu/data_raw", imu(pitch=0.2, rate=0.05))
    found = node.sent["/imu/data"][-1]
    assert found.angular_velocity.z == pytest.approx(0.0, abs=1e-6)
    assert node.sent["/imu/rpy/filtered"][-1].vector.y == pytest.approx(0.2, abs=1e-3)
    assert node.sent["/imu/steady_state"][-1].data
    assert node.sent["/tf"][-1].transforms[0].header.frame_id == "odom"
    one.close()


@pytest.mark.parametrize(
    "program", ["imu_filter_madgwick imu_filter_node", "imu_complementary_filter complementary_filter_node"]
)
def test_the_program_filters_an_imu(ros: RosSystem, program: str) -> None:
    ros.serve_master()
    process = ros.pipros.start("rosrun", *program.split(), "_use_mag:=false", "_fixed_frame:=world")
    found = Inbox()
    kind: Any = load_message_class("sensor_msgs/Imu")
    with Node("robot", environment=Environment(master_uri=ros.master_uri)) as robot:
        wait_until_connected(robot.subscribe("/imu/data", kind, found))  # the first message is exact
        raw = robot.advertise("/imu/data_raw", kind, queue_size=5)

        def is_filtered() -> bool:
            raw.publish(imu(pitch=0.3))
            return bool(found.messages)

        wait_until(is_filtered, 30)
    orientation = found.messages[0].orientation
    assert 2 * math.atan2(orientation.y, orientation.w) == pytest.approx(0.3)
    process.press_ctrl_c()
    assert process.wait() == 0
