from __future__ import annotations

from typing import Any

import pytest

from pipros_libraries.teleoperation.velocity_mux import InvalidSource, VelocityMux, VelocitySource, source


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
