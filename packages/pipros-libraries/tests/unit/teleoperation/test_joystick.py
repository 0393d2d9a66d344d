from __future__ import annotations

import pytest

from pipros_libraries.teleoperation.joystick import AXIS, BUTTON, EVENT, INIT, Joystick, StickChange


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
