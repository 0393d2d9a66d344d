"""Cases by hand; tests.golden.navigation.test_velocity_smoother_as_genuine has genuine commands."""

from __future__ import annotations

import pytest

from pipros_robot.navigation.velocities.velocity_smoother import Feedback, VelocityLimits, VelocitySmoother

LIMITS = VelocityLimits(speed=(1.0, 2.0), acceleration=(1.0, 2.0), deceleration=3.0)


def smoother(feedback: Feedback = Feedback.NONE) -> tuple[VelocitySmoother, list[str]]:
    log: list[str] = []
    return VelocitySmoother(LIMITS, 0.1, feedback, lambda level, text: log.append(text)), log


def test_a_command_is_approached_and_repeated() -> None:
    one, _ = smoother()
    assert one.step(1.0) is None
    one.command((0.25, 0.0), 1.0)
    assert [one.step(1.0) for _ in range(4)] == [(0.1, 0.0), (0.2, 0.0), (0.25, 0.0), (0.25, 0.0)]


def test_commands_are_clamped_and_braking_is_faster() -> None:
    one, _ = smoother()
    one.command((9.0, float("nan")), 1.0)
    for _ in range(10):
        last = one.step(1.0)
    assert last == pytest.approx((1.0, 0.0))
    one.command((0.0, 0.0), 1.1)
    assert one.step(1.1) == pytest.approx((0.7, 0.0))


def test_both_axes_keep_the_direction_of_the_change() -> None:
    one, _ = smoother()
    one.command((1.0, 0.5), 1.0)
    assert one.step(1.0) == pytest.approx((0.1, 0.05))
    two, _ = smoother()
    two.command((0.1, 2.0), 1.0)
    assert two.step(1.0) == pytest.approx((0.01, 0.2))


def test_a_silent_input_stops_the_robot() -> None:
    one, log = smoother()
    one.command((0.1, 0.0), 1.0)
    assert (one.step(1.29), one.step(1.31)) == ((0.1, 0.0), (0.0, 0.0))
    assert log == ["the input is silent, so the robot is stopped (after 0.31 s)"]
    assert one.step(1.4) is None


def test_a_robot_that_slips_is_followed() -> None:
    one, log = smoother(Feedback.COMMANDS)
    one.measured((0.5, 0.0))
    one.command((1.0, 0.0), 1.0)
    assert one.step(1.0) == pytest.approx((0.6, 0.0))
    assert "replaces the last command" in log[0]


def test_a_robot_that_still_reverses_brakes() -> None:
    one, _ = smoother(Feedback.ODOMETRY)
    one.measured((-0.1, 0.0))
    one.command((1.0, 0.0), 1.0)
    assert one.step(1.0) == pytest.approx((0.3, 0.0))
