"""The filters of robot_localization of both sides, on the same messages."""

from __future__ import annotations

import random
import time
from typing import Any

import pytest

from pipros.libraries.transforms.pose import from_roll_pitch_yaw
from pipros.msg import load_message_class
from tests.support.both_filters import SIDES, BothFilters, both_filters, difference, stamped
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LIMIT = 1e-6
PLANAR = [True, True, False, False, False, True, True, True, False, False, False, True] + [False] * 3
POSE_6 = [True] * 6 + [False] * 9
ALL_12 = [True] * 12 + [False] * 3
TWIST_6 = [False] * 6 + [True] * 6 + [False] * 3
IMU = [False] * 3 + [True] * 3 + [False] * 3 + [True] * 6


def covariance(size: int, numbers: random.Random) -> list[float]:
    """Return a random symmetric positive definite matrix, row by row."""
    rows = [[numbers.gauss(0.0, 0.1) for _ in range(size)] for _ in range(size)]
    return [
        sum(rows[i][k] * rows[j][k] for k in range(size)) + (0.01 if i == j else 0.0)
        for i in range(size)
        for j in range(size)
    ]


def set_vector(vector: Any, values: Any) -> None:
    vector.x, vector.y, vector.z = values


def set_quaternion(quaternion: Any, roll: float, pitch: float, yaw: float) -> None:
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = from_roll_pitch_yaw(roll, pitch, yaw)


def fill_pose(given: Any, time_s: float, numbers: random.Random) -> None:
    """Set a noisy pose on a curve through space."""
    set_vector(given.pose.position, (time_s + numbers.gauss(0, 0.05), 0.3 * time_s, numbers.gauss(0, 0.05)))
    set_quaternion(given.pose.orientation, numbers.gauss(0.2, 0.02), numbers.gauss(-0.1, 0.02), 0.7 * time_s)
    given.covariance = covariance(6, numbers)


def fill_twist(given: Any, numbers: random.Random) -> None:
    set_vector(given.twist.linear, (numbers.gauss(1, 0.1), numbers.gauss(0.1, 0.1), numbers.gauss(0, 0.1)))
    set_vector(given.twist.angular, (numbers.gauss(0, 0.1), numbers.gauss(0, 0.1), numbers.gauss(0.7, 0.1)))
    given.covariance = covariance(6, numbers)


def message(kind: str, time_s: float, frames: str, numbers: random.Random) -> Any:
    """Return a message for `time_s` after the start. `frames`: its frame and, after a space, the child."""
    frame, _, child = frames.partition(" ")
    made = stamped(kind, 1000.0 + time_s, frame)
    if kind in ("odom", "pose"):
        fill_pose(made.pose, time_s, numbers)
    if kind in ("odom", "twist"):
        fill_twist(made.twist, numbers)
    if kind == "odom":
        made.child_frame_id = child or "base_link"
    if kind == "imu":
        set_quaternion(made.orientation, numbers.gauss(0.2, 0.02), numbers.gauss(-0.1, 0.02), 0.7 * time_s)
        set_vector(
            made.angular_velocity, (numbers.gauss(0, 0.1), numbers.gauss(0, 0.1), numbers.gauss(0.7, 0.1))
        )
        set_vector(
            made.linear_acceleration,
            (numbers.gauss(0, 0.2), numbers.gauss(0.5, 0.2), numbers.gauss(9.8, 0.2)),
        )
        for name in ("orientation", "angular_velocity", "linear_acceleration"):
            setattr(made, f"{name}_covariance", covariance(3, numbers))
    return made


def static(*frames: tuple[str, str, tuple[float, ...], tuple[float, float, float]]) -> Any:
    """Return a message with static transforms: parent, child, position and angles of each."""
    transform_class: Any = load_message_class("geometry_msgs/TransformStamped")
    tf_class: Any = load_message_class("tf2_msgs/TFMessage")
    transforms = []
    for parent, child, position, angles in frames:
        transform = transform_class(child_frame_id=child)
        transform.header.frame_id = parent
        set_vector(transform.transform.translation, position)
        set_quaternion(transform.transform.rotation, *angles)
        transforms.append(transform)
    return tf_class(transforms)


def feed_all(
    both: BothFilters, inputs: dict[str, tuple[str, str]], count: int, *, pause_s: float = 0.0
) -> list[float]:
    """Feed messages of the inputs (kind and frame by topic) in turn; return the differences.

    Args:
        pause_s: pause after the first message, for cycles of the filters without a message.
    """
    numbers = random.Random(7)  # noqa: S311
    found = []
    for index in range(count):
        topic = list(inputs)[index % len(inputs)]
        kind, frames = inputs[topic]
        found.append(difference(*both.feed(topic, message(kind, index * 0.05, frames, numbers))))
        if index == 0:
            time.sleep(pause_s)
    return found


CASES: dict[str, tuple[dict[str, Any], dict[str, tuple[str, str]]]] = {
    "planar odometry": (
        {"two_d_mode": True, "odom0": "/odom0", "odom0_config": PLANAR},
        {"/odom0": ("odom", "odom")},
    ),
    "everything in space": (
        {"odom0": "/odom0", "odom0_config": ALL_12, "imu0": "/imu0", "imu0_config": IMU},
        {"/odom0": ("odom", "odom"), "/imu0": ("imu", "base_link")},
    ),
    "four kinds, dynamic noise": (
        {
            "odom0": "/odom0", "odom0_config": ALL_12, "pose0": "/pose0", "pose0_config": POSE_6,
            "twist0": "/twist0", "twist0_config": TWIST_6, "imu0": "/imu0", "imu0_config": IMU,
            "dynamic_process_noise_covariance": True, "imu0_remove_gravitational_acceleration": True,
        },
        {
            "/odom0": ("odom", "odom"), "/pose0": ("pose", "odom"), "/twist0": ("twist", "base_link"),
            "/imu0": ("imu", "base_link"),
        },
    ),
    "differential odometry": (
        {"odom0": "/odom0", "odom0_config": ALL_12, "odom0_differential": True},
        {"/odom0": ("odom", "odom")},
    ),
    "relative odometry": (
        {"odom0": "/odom0", "odom0_config": ALL_12, "odom0_relative": True},
        {"/odom0": ("odom", "odom")},
    ),
    "rejected measurements": (
        {
            "odom0": "/odom0", "odom0_config": ALL_12, "odom0_pose_rejection_threshold": 2.0,
            "odom0_twist_rejection_threshold": 2.0,
        },
        {"/odom0": ("odom", "odom")},
    ),
    "pose of another frame": (
        {"odom0": "/odom0", "odom0_config": POSE_6, "odom0_pose_use_child_frame": True},
        {"/odom0": ("odom", "start wheel")},
    ),
    "imu on a turning arm": (  # without angular acceleration, which depends on the time of the cycles
        {
            "imu0": "/imu0", "imu0_config": [False] * 12 + [True] * 3,
            "initial_state": [0.0] * 9 + [0.1, 0.2, 0.9] + [0.0] * 3,
        },
        {"/imu0": ("imu", "arm")},
    ),
    "other frames": (
        {
            "odom0": "/odom0", "odom0_config": PLANAR, "imu0": "/imu0", "imu0_config": IMU,
            "twist0": "/twist0", "twist0_config": TWIST_6, "pose0": "/pose0", "pose0_config": POSE_6,
            "imu0_remove_gravitational_acceleration": True,
        },
        {
            "/odom0": ("odom", "start"), "/imu0": ("imu", "imu_link"), "/twist0": ("twist", "wheel"),
            "/pose0": ("pose", "start"),
        },
    ),
}  # fmt: skip

FRAMES = (
    ("odom", "start", (1.0, -2.0, 0.3), (0.1, 0.2, 1.2)),
    ("base_link", "imu_link", (0.0, 0.0, 0.0), (0.1, -0.2, 1.7)),
    ("base_link", "arm", (0.2, 0.1, 0.4), (0.1, -0.2, 1.7)),
    ("base_link", "wheel", (-0.3, 0.2, 0.1), (0.0, 0.0, 1.5707963267948966)),
)


EXTENDED = [("ekf_localization_node", case) for case in CASES]
# The points of the unscented filter need a covariance without the correlations that two_d_mode leaves over.
# They are spread further than by default, because rounding errors grow with 1 / alpha².
UNSCENTED = [("ukf_localization_node", case) for case in CASES if case != "planar odometry"]


@pytest.mark.parametrize(("program", "case"), [*EXTENDED, *UNSCENTED])
def test_the_estimates_are_the_same(plain_ros: RosSystem, program: str, case: str) -> None:
    parameters, inputs = CASES[case]
    common = {"publish_tf": False, "transform_timeout": 10.0, "alpha": 1.0}
    # Genuine filters treat a second message otherwise if it arrives before the cycle after the first one.
    pause_s = 1.0 if "initial_state" in parameters else 0.0
    with both_filters(plain_ros, program, {**common, **parameters}) as both:
        both.publish("/tf_static", static(*FRAMES))
        found = feed_all(both, inputs, 40, pause_s=pause_s)

    assert max(found) < LIMIT, found


def test_commands_move_both_in_the_same_way(plain_ros: RosSystem) -> None:
    numbers = random.Random(3)  # noqa: S311
    parameters = {
        "odom0": "/odom0", "odom0_config": PLANAR, "use_control": True, "control_timeout": 1e12,
        "control_config": [True, False, False, False, False, True], "acceleration_limits": [1.3] * 6,
        "deceleration_limits": [0.7] * 6, "acceleration_gains": [0.8] * 6, "deceleration_gains": [1.1] * 6,
    }  # fmt: skip
    command = message("twist", 0.0, "", numbers).twist.twist
    with both_filters(plain_ros, "ekf_localization_node", {"publish_tf": False, **parameters}) as both:
        both.publish("/cmd_vel", command)
        for _ in range(30):  # each call is answered after the messages that arrived before it
            assert (
                both.call("filter/toggle", "robot_localization/ToggleFilterProcessing", True) == [[False]] * 2
            )
        found = [
            difference(*both.feed("/odom0", message("odom", index * 0.1, "odom", numbers)))
            for index in range(20)
        ]

    assert max(found) < LIMIT, found


def test_late_measurements_are_applied_in_their_order(plain_ros: RosSystem) -> None:
    numbers = random.Random(5)  # noqa: S311
    parameters = {
        "odom0": "/odom0", "odom0_config": ALL_12, "pose0": "/pose0", "pose0_config": POSE_6,
        "pose0_queue_size": 10, "smooth_lagged_data": True, "history_length": 1.0,
    }  # fmt: skip
    found = []
    with both_filters(plain_ros, "ekf_localization_node", {"publish_tf": False, **parameters}) as both:
        for index in range(10):
            both.feed("/odom0", message("odom", index * 0.2, "odom", numbers))
            both.feed("/odom0", message("odom", index * 0.2 + 0.1, "odom", numbers))
            both.publish("/pose0", message("pose", index * 0.2 + 0.05, "odom", numbers))
            late_and_new = both.feed("/pose0", message("pose", index * 0.2 + 0.12, "odom", numbers))
            found.append(difference(*late_and_new))

    assert max(found) < LIMIT, found


def test_predictions_and_a_new_pose_in_simulated_time(plain_ros: RosSystem) -> None:
    numbers = random.Random(6)  # noqa: S311
    clock_class: Any = load_message_class("rosgraph_msgs/Clock")
    parameters = {
        "odom0": "/odom0", "odom0_config": ALL_12, "frequency": 10.0, "sensor_timeout": 5.0,
        "world_frame": "map",
    }  # fmt: skip
    found = []
    with both_filters(plain_ros, "ekf_localization_node", parameters, simulated=True) as both:
        both.publish("/tf_static", static(("odom", "base_link", (1.0, 0.5, 0.0), (0.0, 0.0, 0.4))))

        def set_clock(time_s: float) -> None:
            both.publish("/clock", clock_class(clock=stamped("odom", 1000.0 + time_s).header.stamp))

        def predict(time_s: float) -> float:
            """Move the clock, and return the difference of the predictions for this time."""
            set_clock(time_s)
            return difference(*both.wait_for(1000.0 + time_s))

        set_clock(0.0)
        both.publish("/odom0", message("odom", 0.0, "map", numbers))
        for step in range(1, 45):  # until the first cycle after the message; nothing is predicted yet
            if all(both.outputs.values()):
                break
            set_clock(0.1 * step)
            assert (
                both.call("filter/toggle", "robot_localization/ToggleFilterProcessing", True) == [[False]] * 2
            )
        found += [difference(*both.wait_for(1000.0)), *(predict(time_s) for time_s in (10.0, 15.0, 20.0))]
        both.call("set_pose", "robot_localization/SetPose", message("pose", 20.1, "map", numbers))
        found += [predict(time_s) for time_s in (25.0, 30.0)]
        wait_until(lambda: all(len(each) >= 6 for each in both.transforms.values()), 30, "transforms")
        sent = [both.transforms[side][-1].transforms[0] for side in SIDES]

    assert max(found) < LIMIT, found
    assert [(each.header.frame_id, each.child_frame_id) for each in sent] == [("map", "odom")] * 2
    corrections = [numbers_in(each.transform.translation, each.transform.rotation) for each in sent]
    assert corrections[0] == pytest.approx(corrections[1], abs=LIMIT)


def numbers_in(*parts: Any) -> list[float]:
    return [getattr(part, axis) for part in parts for axis in part.__slots__]
