"""The filters against derivatives by differences, and estimates in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from pipros_robot.navigation.filter.kalman import Control, ExtendedKalmanFilter
from pipros_robot.navigation.filter.state import (
    SIZE,
    Array,
    Measurement,
    VelocityCommand,
    jacobian,
    transition,
    wrapped,
)
from pipros_robot.navigation.filter.unscented import UnscentedKalmanFilter

FILTERS = [ExtendedKalmanFilter, lambda **options: UnscentedKalmanFilter(alpha=1.0, **options)]
NO_NOISE = np.zeros((SIZE, SIZE))


def measured(index: int, value: float, variance: float, threshold: float = np.inf) -> Measurement:
    values, flags = np.zeros(SIZE), np.zeros(SIZE, bool)
    values[index], flags[index] = value, True
    return Measurement("test", 0.0, values, np.eye(SIZE) * variance, flags, threshold)


def moved(state: Array, delta_s: float) -> Array:
    return np.asarray(transition(state[3:6], delta_s) @ state)


@pytest.mark.parametrize("seed", range(5))
def test_the_jacobian_is_the_derivative_of_the_motion(seed: int) -> None:
    numbers = np.random.default_rng(seed)
    state = numbers.uniform(-1, 1, SIZE)
    step = 1e-6
    columns = [
        (moved(state + step * unit, 0.3) - moved(state - step * unit, 0.3)) / (2 * step)
        for unit in np.eye(SIZE)
    ]

    found = jacobian(state, transition(state[3:6], 0.3), 0.3)

    np.testing.assert_allclose(found, np.array(columns).T, atol=1e-8)


def test_many_small_steps_follow_a_circle() -> None:
    kalman = ExtendedKalmanFilter(process_noise=NO_NOISE)
    kalman.state[6], kalman.state[11] = 1.0, 0.5  # a radius of 2 m
    for index in range(20_000):
        kalman.predict(index * 1e-4, 1e-4)

    assert kalman.state[:2] == pytest.approx([2 * np.sin(1.0), 2 - 2 * np.cos(1.0)], abs=1e-3)
    assert kalman.state[5] == pytest.approx(1.0)


@pytest.mark.parametrize("make", FILTERS)
def test_repeated_measurements_give_their_weighted_mean(make: type[ExtendedKalmanFilter]) -> None:
    kalman = make(covariance=np.eye(SIZE) * 4.0, process_noise=NO_NOISE)
    kalman.predict(0.0, 0.0)
    for value, variance in ((1.0, 1.0), (3.0, 0.5)):
        assert kalman.correct(measured(6, value, variance))
        if (
            make is not ExtendedKalmanFilter
        ):  # its covariance is that of the genuine one, see docs/guides/navigation.md
            assert kalman.state[6] == pytest.approx(4.0 / 5.0)
            return

    weights = np.array([1 / 4.0, 1 / 1.0, 1 / 0.5])
    assert kalman.state[6] == pytest.approx(weights @ [0.0, 1.0, 3.0] / weights.sum())
    assert kalman.covariance[6, 6] == pytest.approx(1 / weights.sum())


def test_angles_are_corrected_the_short_way_round() -> None:
    kalman = ExtendedKalmanFilter(covariance=np.eye(SIZE))
    kalman.state[5] = np.pi - 0.1

    kalman.correct(measured(5, -np.pi + 0.1, 1.0))

    assert abs(kalman.state[5]) == pytest.approx(np.pi)


@pytest.mark.parametrize("make", FILTERS)
def test_unlikely_and_infinite_measurements_are_rejected(make: type[ExtendedKalmanFilter]) -> None:
    kalman = make(covariance=np.eye(SIZE) * 0.5)
    kalman.predict(0.0, 0.0)
    before = kalman.state.copy()

    assert not kalman.correct(measured(6, 2.0, 0.5, threshold=2.0))  # exactly two standard deviations
    assert not kalman.correct(measured(6, np.nan, 0.5))
    np.testing.assert_array_equal(kalman.state, before)
    assert kalman.correct(measured(6, 1.9, 0.5, threshold=2.0))


def test_negative_and_tiny_variances_are_corrected() -> None:
    noise = measured(0, 1.0, -2.0).noise(np.array([0]))
    tiny = measured(0, 1.0, 0.0).noise(np.array([0]))

    assert (noise[0, 0], tiny[0, 0]) == (2.0, 1e-9)


def test_the_noise_of_the_pose_grows_with_the_squared_speed() -> None:
    kalman = ExtendedKalmanFilter(process_noise=np.eye(SIZE), covariance=NO_NOISE, is_noise_dynamic=True)
    kalman.state[6], kalman.state[7] = 3.0, 4.0

    kalman.predict(0.1, 0.1)

    assert kalman.covariance[0, 0] == pytest.approx(0.1 * 25)
    assert kalman.covariance[8, 8] == pytest.approx(0.1)


def test_an_unmeasured_yaw_shortens_the_way_of_the_unscented_filter() -> None:
    """To second order, the expected cosine of a yaw with the variance v is 1 - v/2."""
    ways = []
    for kalman in (ExtendedKalmanFilter(), UnscentedKalmanFilter()):
        for step in range(300):
            kalman.predict(step / 30, 1 / 30)
            values = np.zeros(SIZE)
            values[6] = 0.3
            flags = np.zeros(SIZE, bool)
            flags[[2, 3, 4, 6, 7, 8, 9, 10, 11, 14]] = True
            kalman.correct(Measurement("wheels", step / 30, values, np.eye(SIZE) * 1e-3, flags))
        ways.append(kalman.state[0])
    shortened = sum(0.3 / 30 * (1 - 0.06 * step / 30 / 2) for step in range(300))
    assert ways == pytest.approx([3.0, shortened], abs=0.03)


def test_an_impossible_covariance_does_not_stop_the_unscented_filter() -> None:
    kalman = UnscentedKalmanFilter(covariance=np.eye(SIZE))
    kalman.covariance[0, 2] = kalman.covariance[2, 0] = 2.0

    kalman.predict(0.1, 0.1)

    assert np.isfinite(kalman.covariance).all()


@pytest.mark.parametrize(("velocity", "command", "age_s", "expected"), [
    (0.0, 1.0, 0.0, 0.5),  # the gain
    (0.0, 10.0, 0.0, 2.0),  # the limit
    (1.0, 0.5, 0.0, -0.25),  # slower: the gain of deceleration is the same, its limit smaller
    (3.0, -3.0, 0.0, -1.0),  # the other direction: the limit of deceleration
    (1.0, 1.0, 9.0, -0.5),  # too old: stop
])  # fmt: skip
def test_commands_accelerate_within_limits(
    velocity: float, command: float, age_s: float, expected: float
) -> None:
    axes = np.ones(6)
    control = Control(
        np.array([True] + [False] * 5), 2 * axes, 0.5 * axes, 1 * axes, 0.5 * axes, timeout_s=1.0
    )
    control.command = VelocityCommand(command * axes, time_s=0.0)

    _, found = control.accelerations(velocity * axes, age_s)

    assert found.tolist() == [expected, 0, 0, 0, 0, 0]


def test_angles_are_wrapped() -> None:
    angles = np.array([0.5, np.pi, -np.pi, 4.0, -4.0, 20.0])

    np.testing.assert_allclose(
        wrapped(angles), [0.5, np.pi, -np.pi, 4 - 2 * np.pi, 2 * np.pi - 4, 20 - 6 * np.pi]
    )
