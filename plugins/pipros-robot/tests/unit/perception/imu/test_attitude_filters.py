"""Both filters of IMUs, with measurements computed from known orientations."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from pipros_libraries.transforms.pose import Vector, from_roll_pitch_yaw
from pipros_robot.perception.imu.attitude import (
    IDENTITY,
    WORLDS,
    Quaternion,
    inverse,
    orientation_at_rest,
    product,
    turned,
)
from pipros_robot.perception.imu.complementary import GRAVITY, Complementary, Gains
from pipros_robot.perception.imu.madgwick import Madgwick, gradient

DT_S = 0.01
REST: Vector = (0.0, 0.0, 0.0)
NORTH = {"enu": (0.0, 0.4, -0.3), "nwu": (0.4, 0.0, -0.3), "ned": (0.4, 0.0, 0.3)}
"""The magnetic field in each world: north, and into the ground."""


def orientations(count: int = 20) -> Iterator[Quaternion]:
    limits = (math.pi, 1.5, math.pi)
    for roll, pitch, yaw in np.random.default_rng(1).uniform(-1, 1, (count, 3)) * limits:
        yield from_roll_pitch_yaw(roll, pitch, yaw)


def angle(first: Quaternion | None, second: Quaternion) -> float:
    assert first is not None
    difference = product(inverse(first), second)
    return 2 * math.atan2(math.hypot(*difference[:3]), abs(difference[3]))


def measured(orientation: Quaternion, world: str = "nwu") -> tuple[Vector, Vector]:
    """Return the acceleration and the field that an IMU at rest measures."""
    back = inverse(orientation)
    return turned(back, (0.0, 0.0, WORLDS[world].up * GRAVITY)), turned(back, NORTH[world])


@pytest.mark.parametrize("world", sorted(WORLDS))
def test_gravity_and_the_magnetic_field_determine_the_orientation_at_rest(world: str) -> None:
    for true in orientations():
        assert angle(orientation_at_rest(WORLDS[world], *measured(true, world)), true) < 1e-9


def test_in_free_fall_or_a_vertical_field_the_orientation_at_rest_is_unknown() -> None:
    assert orientation_at_rest(WORLDS["enu"], (0.0, 0.05, 0.0)) is None
    assert orientation_at_rest(WORLDS["enu"], (0.0, 0.0, 9.8), (0.0, 0.0, 0.4)) is None
    assert orientation_at_rest(WORLDS["enu"], (0.0, 0.0, 9.8)) == pytest.approx(IDENTITY)


def test_madgwicksgradient_is_the_derivative_of_half_the_squared_error() -> None:
    dice, step = np.random.default_rng(2), 1e-6

    def cost(q: list[float], expected: Vector, seen: Vector) -> float:
        x, y, z, w = q
        rows = (
            (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
            (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
            (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
        )
        errors = [sum(a * b for a, b in zip(row, expected, strict=True)) for row in rows]
        return sum((a - b) ** 2 for a, b in zip(errors, seen, strict=True)) / 2

    for q in orientations(5):
        expected, seen = ((x, y, z) for x, y, z in dice.uniform(-1, 1, (2, 3)))
        slopes = []
        for index in range(4):
            high, low = list(q), list(q)
            high[index] += step
            low[index] -= step
            slopes.append((cost(high, expected, seen) - cost(low, expected, seen)) / (2 * step))
        assert gradient(q, expected, seen) == pytest.approx(slopes, abs=1e-6)


@pytest.mark.parametrize("world", sorted(WORLDS))
def test_madgwick_converges_to_the_true_orientation(world: str) -> None:
    for true in orientations(5):
        one = Madgwick(WORLDS[world], gain=0.5)
        one.orientation = product(true, from_roll_pitch_yaw(0.3, -0.2, 0.4))
        for _ in range(400):
            one.update(REST, *measured(true, world), DT_S)
        assert angle(one.orientation, true) < 0.02


def test_without_a_magnetometer_madgwick_corrects_the_tilt_and_keeps_the_heading() -> None:
    level = from_roll_pitch_yaw(0.0, 0.0, 1.0)
    one = Madgwick(WORLDS["enu"], gain=0.5)
    one.orientation = product(level, from_roll_pitch_yaw(0.2, 0.1, 0.0))
    for _ in range(400):
        one.update(REST, (0.0, 0.0, GRAVITY), None, DT_S)
    assert angle(one.orientation, level) < 0.05
    for _ in range(100):
        one.update((0.0, 0.0, 0.5), (0.0, 0.0, GRAVITY), None, DT_S)
    turned_on = product(level, from_roll_pitch_yaw(0.0, 0.0, 0.5))
    assert angle(one.orientation, turned_on) < 0.05


def test_zeta_removes_the_drift_of_a_gyroscope() -> None:
    errors = []
    for zeta in (0.0, 0.05):
        one = Madgwick(WORLDS["nwu"], gain=0.05, zeta=zeta)
        one.start(*measured(IDENTITY))
        for _ in range(6000):
            one.update((0.0, 0.0, 0.15), *measured(IDENTITY), DT_S)
        errors.append(angle(one.orientation, IDENTITY))
    assert errors[1] < 0.06 < 0.3 < errors[0]


def test_no_measurement_moves_madgwick_before_its_start_or_by_no_acceleration() -> None:
    one = Madgwick(WORLDS["enu"])
    one.update((1.0, 0.0, 0.0), (0.0, 0.0, 9.8), None, DT_S)
    assert one.orientation is None
    assert not one.start(REST, None)
    assert one.start((0.0, 0.0, 9.8), None)
    one.update(REST, REST, None, DT_S)
    assert one.orientation == pytest.approx(IDENTITY)


def test_the_first_measurement_sets_the_complementary_filter() -> None:
    for true in orientations():
        one = Complementary(Gains())
        one.update(REST, *measured(true), DT_S)
        assert angle(one.orientation, true) < 1e-6
    one = Complementary(Gains())
    one.update(REST, (0.0, 0.0, -GRAVITY), None, DT_S)
    assert one.orientation is not None
    assert turned(one.orientation, (0.0, 0.0, -GRAVITY)) == pytest.approx((0.0, 0.0, GRAVITY))


def test_the_complementary_filter_follows_a_turn_and_corrects_its_error() -> None:
    one = Complementary(Gains(do_bias_estimation=False))
    one.update(REST, *measured(IDENTITY), DT_S)
    true = IDENTITY
    for _ in range(300):
        true = product(true, from_roll_pitch_yaw(0.0, 0.0, 0.5 * DT_S))
        one.update((0.0, 0.0, 0.5), *measured(true), DT_S)
    assert angle(one.orientation, true) < 1e-3
    one.orientation = product(true, from_roll_pitch_yaw(0.2, 0.2, 2.0))
    for _ in range(1500):
        one.update(REST, *measured(true), DT_S)
    assert angle(one.orientation, true) < 1e-3


def test_the_bias_of_the_gyroscope_is_estimated_at_rest_only() -> None:
    one = Complementary(Gains())
    for _ in range(1000):
        one.update((0.02, -0.01, 0.03), *measured(IDENTITY), DT_S)
    assert one.is_steady
    assert one.bias == pytest.approx((0.02, -0.01, 0.03), abs=1e-5)
    assert angle(one.orientation, IDENTITY) < 0.01
    one.update((0.3, 0.0, 0.0), *measured(IDENTITY), DT_S)
    assert not one.is_steady
    assert one.bias == pytest.approx((0.02, -0.01, 0.03), abs=1e-5)


@pytest.mark.parametrize(("is_adaptive", "tilt"), [(True, 0.0), (False, math.pi / 4)])
def test_an_adaptive_gain_ignores_accelerations_that_are_not_gravity(is_adaptive: bool, tilt: float) -> None:
    one = Complementary(Gains(do_adaptive_gain=is_adaptive))
    one.update(REST, (0.0, 0.0, GRAVITY), None, DT_S)
    for _ in range(2000):
        one.update(REST, (GRAVITY, 0.0, GRAVITY), None, DT_S)
    assert angle(one.orientation, IDENTITY) == pytest.approx(tilt, abs=1e-3)


def test_a_complementary_filter_without_gravity_or_heading_keeps_its_orientation() -> None:
    complementary = Complementary(Gains(do_bias_estimation=False, do_adaptive_gain=False))
    complementary.update(REST, (0.0, 0.0, GRAVITY), None, DT_S)
    before = complementary.orientation

    complementary.update(REST, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), DT_S)

    assert before is not None
    assert complementary.orientation == pytest.approx(before)
