"""The order in which measurements reach the filter."""

from __future__ import annotations

import numpy as np
import pytest

from pipros_robot.navigation.filter.kalman import Control, ExtendedKalmanFilter
from pipros_robot.navigation.filter.state import SIZE, Measurement, VelocityCommand
from pipros_robot.navigation.filter.timeline import GAP_S, Timeline


def at(time_s: float, value: float, index: int = 6) -> Measurement:
    values, flags = np.zeros(SIZE), np.zeros(SIZE, bool)
    values[index], flags[index] = value, True
    return Measurement("test", time_s, values, np.eye(SIZE) * 0.1, flags)


def timeline(**options: float) -> Timeline:
    return Timeline(ExtendedKalmanFilter(), sensor_timeout_s=0.5, **options)


def test_the_first_measurement_is_taken_over() -> None:
    time = timeline()
    assert not time.has_started

    time.add(at(1.0, 2.0))
    time.advance(1.0)

    assert (time.time_s, time.kalman.state[6]) == (1.0, 2.0)
    assert time.kalman.covariance[6, 6] == 0.1


def test_measurements_of_the_future_wait() -> None:
    time = timeline()
    time.add(at(3.0, 2.0))
    time.add(at(1.0, 1.0))
    time.advance(2.0)
    assert time.time_s == 1.0

    time.advance(3.0)

    assert time.time_s == 3.0


def test_late_measurements_have_the_same_effect_as_in_time() -> None:
    in_time, late = timeline(), timeline(history_s=10.0)
    for measurement in (at(1.0, 1.0), at(1.4, 1.5, 0), at(1.5, 2.0), at(1.7, 0.3, 5), at(2.0, 2.5)):
        in_time.add(measurement)
    in_time.advance(2.0)
    for measurement in (at(1.0, 1.0), at(1.5, 2.0), at(2.0, 2.5), at(1.7, 0.3, 5), at(1.4, 1.5, 0)):
        late.add(measurement)
        late.advance(2.0)

    np.testing.assert_allclose(late.kalman.state, in_time.kalman.state, atol=1e-12)
    np.testing.assert_allclose(late.kalman.covariance, in_time.kalman.covariance, atol=1e-12)
    assert not late.is_history_too_short


def test_measurements_that_are_applied_again_are_predicted_with_their_commands() -> None:
    axes = np.ones(6)
    in_time, late = timeline(history_s=10.0), timeline(history_s=10.0)
    orders = (
        (in_time, (at(1.0, 0.5), at(1.4, 0.0, 5), at(1.5, 0.7), at(2.0, 1.5))),
        (late, (at(1.0, 0.5), at(1.5, 0.7), at(2.0, 1.5), at(1.4, 0.0, 5))),
    )
    for time, measurements in orders:
        time.kalman.control = Control(np.ones(6, bool), axes, axes, axes, axes, timeout_s=5.0)
        for measurement in measurements:
            time.add(measurement)
            time.advance(2.0)
            time.kalman.control.command = VelocityCommand(2.0 * axes, time_s=1.0)

    np.testing.assert_allclose(late.kalman.state, in_time.kalman.state, atol=1e-12)
    assert late.kalman.control is not None
    assert late.kalman.control.command is not None


def test_a_history_that_is_too_short_is_reported() -> None:
    time = timeline(history_s=0.1)
    for measurement in (at(1.0, 1.0), at(1.5, 2.0), at(1.2, 2.0)):
        time.add(measurement)
        time.advance(2.0 if measurement.time_s > 1 else 1.0)

    assert time.is_history_too_short
    assert time.time_s == 1.5


def test_without_a_history_late_measurements_correct_the_newest_state() -> None:
    time = timeline()
    for measurement in (at(1.0, 1.0), at(2.0, 1.0), at(1.5, 3.0)):
        time.add(measurement)
        time.advance(2.0)

    assert time.time_s == 2.0
    assert time.kalman.state[6] > 1.0


def test_the_state_is_predicted_after_the_timeout() -> None:
    time = timeline()
    time.add(at(1.0, 2.0))
    time.advance(1.0)
    time.advance(1.4)
    assert time.time_s == 1.0

    time.advance(1.5)

    assert (time.time_s, time.kalman.state[0]) == (1.5, pytest.approx(1.0))


def test_a_change_of_clocks_is_not_predicted() -> None:
    time = timeline()
    for stamp_s in (1.0, 2.0 + GAP_S):
        time.add(at(stamp_s, 2.0))
        time.advance(stamp_s)

    assert time.time_s == 2.0 + GAP_S
    assert time.kalman.state[0] == pytest.approx(0.02, abs=1e-3)


def test_a_reset_returns_to_the_first_estimate() -> None:
    time = timeline()
    time.add(at(1.0, 2.0))
    time.advance(1.0)

    time.reset()

    assert not time.has_started
    assert not time.kalman.state.any()
