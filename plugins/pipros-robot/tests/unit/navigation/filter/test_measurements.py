"""Measurements from data in other frames, and from differences of poses."""

from __future__ import annotations

import numpy as np
import pytest

from pipros_libraries.transforms.pose import IDENTITY, Pose, from_roll_pitch_yaw
from pipros_robot.navigation.filter.measurements import InputSettings, Readings
from pipros_robot.navigation.filter.state import OUT_OF_PLANE, SIZE, Flags

FRAMES: dict[tuple[str, str], Pose] = {
    ("odom", "start"): (1.0, 2.0, 0.0, *from_roll_pitch_yaw(0, 0, np.pi / 2)),
    ("base_link", "imu"): (0.5, 0.0, 0.0, *from_roll_pitch_yaw(0, 0, np.pi / 2)),
    ("base_link", "under"): (0.0, 0.0, 0.0, *from_roll_pitch_yaw(np.pi, 0, 0)),
}
SIX = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])


def readings(**options: bool) -> Readings:
    given = {"in_plane": False, **options}
    return Readings(
        "odom", "base_link", lambda target, source, _: FRAMES.get((target, source)), gravity=9.8, **given
    )


def flags(*indices: int) -> Flags:
    found = np.zeros(SIZE, bool)
    found[list(indices)] = True
    return found


def test_a_pose_is_converted_with_its_flags_and_covariance() -> None:
    found = readings().pose(
        InputSettings("a", flags(0, 5)), "start", 10**9, (1.0, 0.0, 0.0, *IDENTITY[3:]), SIX
    )

    assert found is not None
    assert found.values[:6] == pytest.approx([1.0, 3.0, 0.0, 0.0, 0.0, np.pi / 2])
    assert np.flatnonzero(found.flags).tolist() == [1, 5]
    np.testing.assert_allclose(found.covariance.diagonal()[:6], [2, 1, 3, 5, 4, 6])
    assert found.time_s == 1.0


def test_an_unknown_frame_gives_nothing_but_the_target_itself_is_known() -> None:
    made = readings()

    assert made.pose(InputSettings("a", flags(0)), "mars", 0, IDENTITY, SIX) is None
    assert made.pose(InputSettings("a", flags(0)), "odom", 0, IDENTITY, SIX) is not None
    assert made.pose(InputSettings("a", flags(0)), "", 0, IDENTITY, SIX) is not None


def test_a_differential_pose_measures_velocity_from_the_second_on() -> None:
    made, own = readings(), InputSettings("a", flags(0, 1, 5), is_differential=True)
    turned = from_roll_pitch_yaw(0, 0, np.pi / 2)
    assert made.pose(own, "odom", 10**9, (1.0, 1.0, 0.0, *turned), SIX) is None

    found = made.pose(own, "odom", 3 * 10**9, (1.0, 2.0, 0.0, *turned), SIX)

    assert found is not None
    assert found.values[6:12] == pytest.approx([0.5, 0, 0, 0, 0, 0])  # forward, though along y of the world
    assert np.flatnonzero(found.flags).tolist() == [6, 7, 11]
    assert found.covariance[6, 6] == pytest.approx((1.0 + 1.0) * 2.0)
    assert made.pose(own, "odom", 3 * 10**9, IDENTITY, SIX) is None  # no time has passed


def test_a_relative_pose_begins_at_zero() -> None:
    made, own = readings(), InputSettings("a", flags(0, 1, 5), is_relative=True)
    start: Pose = (4.0, 5.0, 0.0, *from_roll_pitch_yaw(0, 0, np.pi))
    made.pose(own, "odom", 0, start, SIX)

    found = made.pose(own, "odom", 10**9, (3.0, 5.0, 0.0, *start[3:]), SIX)

    assert found is not None
    assert found.values[:3] == pytest.approx([1.0, 0.0, 0.0])


def test_a_sensor_off_the_center_moves_when_the_robot_turns() -> None:
    made = readings()
    made.state = np.zeros(SIZE)
    made.state[11] = 2.0

    twist = made.twist(InputSettings("a", flags(6)), "imu", 0, np.zeros(6), SIX)
    push = made.acceleration(InputSettings("a", flags(12)), "imu", 0, np.zeros(3), np.eye(3), None)

    assert twist is not None
    assert push is not None
    assert twist.values[6:9] == pytest.approx(
        [0.0, -1.0, 0.0]
    )  # the sensor stands still, so the center moves
    assert push.values[12:15] == pytest.approx(
        [2.0, 0.0, 0.0]
    )  # ω² r: the center is pulled around the sensor


def test_gravity_is_removed_with_the_attitude() -> None:
    made, own = readings(), InputSettings("a", flags(12, 14), removes_gravity=True)
    tilted: Pose = (0.0, 0.0, 0.0, *from_roll_pitch_yaw(0.3, 0.2, 1.0))
    upside: Pose = (0.0, 0.0, 0.0, *from_roll_pitch_yaw(np.pi, 0.0, 0.0))
    measured = np.array(
        [-9.8 * np.sin(0.2), 9.8 * np.cos(0.2) * np.sin(0.3), 9.8 * np.cos(0.2) * np.cos(0.3)]
    )

    level = made.acceleration(own, "base_link", 0, measured, np.eye(3), tilted)
    under = made.acceleration(own, "under", 0, np.array([0.0, 0.0, -9.8]), np.eye(3), upside)
    unknown = made.acceleration(own, "under", 0, np.array([0.0, 0.0, -9.8]), np.eye(3), None)

    for found in (level, under, unknown):
        assert found is not None
        assert found.values[12:15] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_in_the_plane_everything_else_is_zero_with_certainty() -> None:
    found = readings(in_plane=True).twist(InputSettings("a", flags(6)), "", 0, np.ones(6), SIX)

    assert found is not None
    assert found.flags[OUT_OF_PLANE].all()
    assert not found.values[OUT_OF_PLANE].any()
    np.testing.assert_allclose(found.covariance.diagonal()[OUT_OF_PLANE], 1e-6)
