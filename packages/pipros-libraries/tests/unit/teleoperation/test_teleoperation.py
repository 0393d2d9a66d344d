"""Velocities from keys and joysticks, and the choice among sources."""

import math
from typing import Any

import pytest

from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.teleoperation.joy_commands import AxisMap, JoyCommands, JoySilence, by_direction
from pipros_libraries.teleoperation.joystick import AXIS, BUTTON, EVENT, INIT, Joystick, StickChange
from pipros_libraries.teleoperation.key_bindings import KeyedMotion
from pipros_libraries.teleoperation.velocity_mux import InvalidSource, VelocityMux, VelocitySource, source


def test_keys_move_until_any_other_key_stops() -> None:
    motion = KeyedMotion()
    assert not motion.press("u")
    assert (motion.linear, motion.angular) == ((0.5, 0.0, 0.0), 1.0)
    motion.press("M")
    assert (motion.linear, motion.angular) == ((-0.5, 0.5, 0.0), 0.0)
    motion.press("t")
    assert motion.linear == (0.0, 0.0, 0.5)
    motion.press("k")
    assert (motion.linear, motion.angular) == ((0.0, 0.0, 0.0), 0.0)


def test_speeds_change_by_a_tenth_up_to_their_limits_while_the_robot_moves() -> None:
    motion = KeyedMotion(speed_limit=0.58, turn_limit=1.05)
    motion.press("i")
    assert motion.press("q")
    assert motion.linear[0] == pytest.approx(0.55)
    motion.press("q")
    assert (motion.speed, motion.turn) == (0.58, 1.05)
    motion.press("x")
    motion.press("c")
    assert (motion.speed, motion.turn) == (pytest.approx(0.522), pytest.approx(0.945))


# Joystick


def event(value: int, kind: int, number: int) -> bytes:
    return EVENT.pack(1234, value, kind, number)


def test_recorded_bytes_are_an_axis_and_a_button() -> None:
    stick = Joystick(deadzone=0.0)
    assert stick.apply(bytes.fromhex("10270000 0180 02 01".replace(" ", ""))) is StickChange.AXIS
    assert stick.apply(bytes.fromhex("20270000 0100 01 03".replace(" ", ""))) is StickChange.BUTTON
    assert stick.axes == [0.0, 1.0]  # up is -32767 of the device
    assert stick.buttons == [0, 0, 0, 1]


@pytest.mark.parametrize(
    ("value", "position"), [(0, 0.0), (3276, 0.0), (-3276, 0.0), (32767, -1.0), (-32767, 1.0), (18022, -0.5)]
)
def test_the_rest_of_an_axis_is_stretched_over_its_range(value: int, position: float) -> None:
    stick = Joystick(deadzone=0.1)
    stick.apply(event(value, AXIS, 0))
    assert stick.axes == [pytest.approx(position, abs=1e-4)]
    assert str(stick.axes[0]) != "-0.0"


def test_initial_events_describe_the_state() -> None:
    stick = Joystick()
    assert stick.apply(event(1, BUTTON | INIT, 1)) is StickChange.INITIAL
    assert stick.apply(event(0, AXIS | INIT, 2)) is StickChange.INITIAL
    assert (stick.buttons, stick.axes) == ([0, 1], [0.0, 0.0, 0.0])
    assert stick.apply(event(1, 4, 0)) is StickChange.NOTHING


def test_triggers_rest_at_one_until_they_were_moved() -> None:
    stick = Joystick(has_triggers=True)
    for number in range(6):
        stick.apply(event(0, AXIS | INIT, number))
    assert stick.axes == [0, 0, 1, 0, 0, 1]
    stick.apply(event(0, AXIS, 2))
    assert stick.axes[2] == 0


def test_sticky_buttons_change_when_pressed() -> None:
    stick = Joystick(is_sticky=True)
    seen = []
    for value in (1, 0, 1, 0):
        stick.apply(event(value, BUTTON, 0))
        seen.append(stick.buttons[0])
    assert seen == [1, 1, 0, 0]


# Joy commands


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


# Velocity mux


def mux(*priorities: int, lock: VelocitySource | None = None, timeout_s: float = 0.5) -> VelocityMux:
    inputs = [
        VelocitySource(f"i{number}", f"v{number}", timeout_s, each) for number, each in enumerate(priorities)
    ]
    return VelocityMux(inputs, [lock] if lock else [])


def test_the_highest_priority_wins_until_it_falls_silent() -> None:
    one = mux(10, 100)
    low, high = one.inputs
    assert one.passes(low, 5.0)
    assert one.passes(high, 5.1)
    assert not one.passes(low, 5.6)
    assert one.passes(low, 5.61)


def test_of_equal_priorities_the_first_wins_and_priority_0_never() -> None:
    one = mux(0, 7, 7)
    assert not one.passes(one.inputs[0], 5.0)
    assert one.passes(one.inputs[2], 5.0)
    assert one.passes(one.inputs[1], 5.0)
    assert not one.passes(one.inputs[2], 5.0)


def test_an_input_without_a_timeout_wins_even_if_it_never_sent() -> None:
    one = mux(10, 100, timeout_s=0.0)
    assert not one.passes(one.inputs[0], 5.0)


def test_a_lock_masks_lower_priorities_only() -> None:
    lock = VelocitySource("pause", "pause", 0.0, 50)
    one = mux(10, 50, lock=lock)
    assert one.passes(one.inputs[0], 5.0)
    one.lock(lock, True, 5.0)
    assert not one.passes(one.inputs[0], 5.0)
    assert one.passes(one.inputs[1], 5.0)
    one.lock(lock, False, 5.1)
    assert one.passes(one.inputs[0], 5.6)


def test_a_lock_with_a_timeout_is_on_while_its_source_is_silent() -> None:
    lock = VelocitySource("alive", "alive", 0.5, 255)
    one = mux(10, lock=lock)
    assert not one.passes(one.inputs[0], 5.0)
    one.lock(lock, False, 5.0)
    assert one.passes(one.inputs[0], 5.5)
    assert not one.passes(one.inputs[0], 5.6)


def test_the_state_is_shown_as_by_twist_mux() -> None:
    one = mux(10, lock=VelocitySource("pause", "stop", 0.0, 200))
    one.passes(one.inputs[0], 5.0)
    assert one.values(5.0) == {
        "velocity i0": " unmasked (listening to v0 @ 0.500000s with priority #10)",
        "lock pause": " free (listening to stop @ 0.000000s with priority #200)",
        "current priority": "0",
    }
    one.lock(one.locks[0], True, 5.0)
    assert one.values(5.0)["velocity i0"].startswith(" masked")
    assert one.values(5.0)["lock pause"].startswith(" locked")
    assert one.values(5.0)["current priority"] == "200"


def test_sources_are_read_from_parameters() -> None:
    entry = {"name": "joy", "topic": "joy_vel", "timeout": 1, "priority": 300}
    assert source(entry, "~topics[0]") == VelocitySource("joy", "joy_vel", 1.0, 255)
    wrong: tuple[tuple[str, Any, str], ...] = (
        ("name", 3, r"~topics\[0\]: name must be a name, got 3"),
        ("topic", "", "topic must be the name of a topic"),
        ("timeout", "soon", "timeout must be a number of seconds, got 'soon'"),
        ("timeout", float("nan"), "timeout must be a finite number of seconds, got nan"),
        ("priority", 1.5, "priority must be an integer from 0 to 255, got 1.5"),
        ("priority", None, "got None"),
    )
    for key, value, text in wrong:
        with pytest.raises(InvalidSource, match=text):
            source(entry | {key: value}, "~topics[0]")
    with pytest.raises(InvalidSource, match="must be a mapping"):
        source("joy", "~topics[0]")
