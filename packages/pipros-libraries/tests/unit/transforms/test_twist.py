"""Velocities of frames, from two of their poses."""

from __future__ import annotations

import math

import pytest

from pipros_libraries.transforms.pose import IDENTITY, Pose
from pipros_libraries.transforms.twist import interval_around, twist

S = 1_000_000_000
QUARTER = math.sqrt(0.5)


def at(x: float, yaw: float = 0.0) -> Pose:
    return (x, 0.0, 0.0, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


@pytest.mark.parametrize(
    ("time", "latest", "expected"),
    [(10 * S, 20 * S, (9 * S, 11 * S)), (10 * S, 10 * S, (8 * S, 10 * S)), (S, S, (100_000, S))],
)
def test_the_interval_ends_with_the_buffer_and_begins_after_zero(
    time: int, latest: int, expected: tuple[int, int]
) -> None:
    assert interval_around(time, latest, 2 * S) == expected


def test_a_frame_that_moves_straight_has_a_linear_velocity_only() -> None:
    linear, angular = twist(at(1.0), at(2.0), S // 2, IDENTITY, IDENTITY)

    assert (linear, angular) == ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("turn", [1.0, -1.0, 3.0])
def test_a_frame_that_turns_has_an_angular_velocity_of_either_sign(turn: float) -> None:
    _, angular = twist(at(0.0, 0.5), at(0.0, 0.5 + turn), 2 * S, IDENTITY, IDENTITY)

    assert angular == pytest.approx((0.0, 0.0, turn / 2))


def test_velocities_are_turned_into_the_reference_frame() -> None:
    tracked = (0.0, 0.0, 0.0, 0.0, 0.0, QUARTER, QUARTER)

    linear, _ = twist(at(0.0), at(1.0), S, tracked, IDENTITY)

    assert linear == pytest.approx((0.0, 1.0, 0.0))


def test_the_reference_point_shifts_the_velocity_as_in_noetic() -> None:
    reference_point = (0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0)

    linear, _ = twist(at(0.0), at(0.0, 0.5), S, at(2.0), reference_point)

    assert linear == pytest.approx((1.5, 1.5 - 2.0 * 0.5, 1.5))  # 1.5 is the scalar product of (0, 0, 0.5)
