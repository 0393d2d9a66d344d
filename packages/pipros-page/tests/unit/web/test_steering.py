"""Velocity commands: limits, silence, and the one command that stops the robot."""

from __future__ import annotations

from pipros_page.steering import SILENCE_S, ZERO, Velocity, VelocityCommands

MOST = Velocity(0.5, 1.0)


def test_a_command_is_repeated_until_the_browser_falls_silent() -> None:
    commands = VelocityCommands(MOST)
    commands.steer(Velocity(0.3, -0.2), 10.0)
    assert commands.due(10.0) == Velocity(0.3, -0.2)
    assert commands.due(10.0 + SILENCE_S - 0.01) == Velocity(0.3, -0.2)
    assert commands.due(10.0 + SILENCE_S) == ZERO
    assert commands.due(10.7) is None


def test_silence_does_not_let_an_old_command_return() -> None:
    commands = VelocityCommands(MOST)
    commands.steer(Velocity(0.3, 0.0), 10.0)
    assert commands.due(10.0) == Velocity(0.3, 0.0)
    assert commands.due(11.0) == ZERO
    assert commands.due(10.1) is None  # even for a clock that went back


def test_letting_go_stops_the_robot_once() -> None:
    commands = VelocityCommands(MOST)
    commands.steer(Velocity(0.3, 0.0), 10.0)
    commands.due(10.0)
    commands.steer(ZERO, 10.1)
    assert commands.due(10.1) == ZERO
    assert commands.due(10.2) is None
    assert commands.end() is None


def test_the_end_stops_a_moving_robot_once() -> None:
    commands = VelocityCommands(MOST)
    assert commands.end() is None
    commands.steer(Velocity(0.3, 0.0), 10.0)
    commands.due(10.0)
    assert commands.end() == ZERO
    assert commands.end() is None


def test_commands_are_reduced_to_the_limits() -> None:
    commands = VelocityCommands(MOST)
    commands.steer(Velocity(9.0, -9.0), 10.0)
    assert commands.due(10.0) == Velocity(0.5, -1.0)
