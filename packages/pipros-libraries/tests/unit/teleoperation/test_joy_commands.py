from __future__ import annotations

import math
from typing import Any

import pytest

from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.teleoperation.joy_commands import AxisMap, JoyCommands, JoySilence, by_direction

LINEAR = AxisMap({"x": 1.0}, {"x": 0.5}, {"x": 2.0})
ANGULAR = AxisMap({"yaw": 0.0}, {"yaw": 0.4}, {"yaw": 0.4})


def speeds(commands: JoyCommands, axes: list[float], buttons: list[int]) -> tuple[float, float] | None:
    command = commands.command(axes, buttons)
    return command and (command[0]["x"], command[1]["yaw"])


def test_the_robot_moves_only_while_the_button_is_held_and_is_stopped_once() -> None:
    commands = JoyCommands(LINEAR, ANGULAR, enable_button=0, turbo_button=1)
    assert speeds(commands, [1.0, 1.0], [0, 0]) is None
    assert speeds(commands, [1.0, 1.0], [1, 0]) == (0.5, 0.4)
    assert speeds(commands, [0.5, -1.0], [0, 1]) == (-2.0, 0.2)
    assert speeds(commands, [0.5, -1.0], [0, 0]) == (0.0, 0.0)
    assert speeds(commands, [0.5, -1.0], [0, 0]) is None


def test_a_joystick_without_the_axis_or_the_buttons_is_ignored() -> None:
    commands = JoyCommands(LINEAR, ANGULAR)
    assert speeds(commands, [], []) is None
    assert speeds(commands, [], [1]) == (0.0, 0.0)


def test_parameters_are_a_number_or_numbers_by_direction() -> None:
    assert by_direction(3, "~axis_linear", "x", "xyz") == {"x": 3.0}
    assert by_direction({"x": 1, "y": 0.5}, "~scale_linear", "x", "xyz") == {"x": 1.0, "y": 0.5}
    for wrong in ("1", True, {"u": 1}, {"x": None}, [1]):
        value: Any = wrong
        with pytest.raises(InvalidParameter, match=r"~axis_linear must be a number or map directions \(x"):
            by_direction(value, "~axis_linear", "x", "xyz")


def test_only_a_joystick_that_repeats_its_state_must_not_be_silent() -> None:
    changing, repeating = JoySilence(), JoySilence()
    states = [0.1, 0.2, 0.2, 0.3, 0.2]
    assert {changing.after([each], [1]) for each in states * 3} == {math.inf}
    assert [repeating.after([0.5], [1]) for _ in range(5)] == [math.inf] * 3 + [0.5] * 2
    assert repeating.after([0.7], [1]) == 0.5
    assert JoySilence(2.0).after([0.5], [1]) == 2.0
