from __future__ import annotations

import signal

import pytest

from tests.support.kill_schedule import kill_schedule

VICTIMS = ("master", "talker", "recorder")


def test_the_same_seed_gives_the_same_schedule_and_another_another() -> None:
    assert kill_schedule(1, VICTIMS, 20) == kill_schedule(1, reversed(VICTIMS), 20)
    assert kill_schedule(1, VICTIMS, 20) != kill_schedule(2, VICTIMS, 20)


def test_each_is_killed_once_before_any_is_killed_again() -> None:
    victims = [kill.victim for kill in kill_schedule(3, VICTIMS, 9)]

    assert [sorted(victims[start : start + 3]) for start in (0, 3, 6)] == [sorted(VICTIMS)] * 3


def test_waits_and_signals_are_the_requested_ones() -> None:
    schedule = kill_schedule(3, VICTIMS, 50, after=(2, 4), signals=[signal.SIGKILL])

    assert {kill.after for kill in schedule} == {2, 3, 4}
    assert {kill.signal for kill in schedule} == {signal.SIGKILL}


def test_a_schedule_without_victims_is_refused() -> None:
    with pytest.raises(ValueError, match="victims and signals must not be empty"):
        kill_schedule(1, [], 1)
