from __future__ import annotations

import pytest

from pipros_libraries.teleoperation.key_bindings import KeyedMotion


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
