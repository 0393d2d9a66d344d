"""Rate limits for the messages of one client."""

from __future__ import annotations

import pytest

from pipros.basics.limits import Limits
from pipros.bridges.limits import BridgeLimits
from pipros.bridges.pace import BURST_S, BUSY_SHARE, ReadPace, SharedWork

LIMITS = Limits(tables=(BridgeLimits(bridge_client_rate=10, bridge_client_rate_bytes=1000),))


class Clock:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_a_client_within_both_limits_is_not_delayed() -> None:
    clock = Clock()
    pace = ReadPace(LIMITS, clock)
    for _ in range(100):
        assert pace.delay_s(50) == 0
        clock.now_s += 0.11


@pytest.mark.parametrize(("size", "rate"), [(1, 10), (500, 2)])
def test_a_client_that_waits_as_required_keeps_the_limit(size: int, rate: int) -> None:
    clock = Clock()
    pace = ReadPace(LIMITS, clock)
    sent = 0
    while clock.now_s < 110:
        clock.now_s += pace.delay_s(size)
        sent += 1
    assert sent == pytest.approx(rate * (10 + BURST_S), abs=2)


def test_a_silent_client_saves_one_burst_only() -> None:
    clock = Clock()
    pace = ReadPace(LIMITS, clock)
    clock.now_s += 3600
    assert [pace.delay_s(500) for _ in range(3)] == pytest.approx([0, 0, 0.5])


def run_busily(count: int, seconds: float, step_s: float = 0.01) -> list[float]:
    """Return the processor time that each of some busy clients of one server gets."""
    clock, work = Clock(), SharedWork()
    paces = [ReadPace(Limits(), clock, work) for _ in range(count)]
    worked, due = [0.0] * count, [clock.now_s] * count
    end_s = clock.now_s + seconds
    while clock.now_s < end_s:
        for number, pace in enumerate(paces):
            if due[number] <= clock.now_s:
                clock.now_s += step_s
                worked[number] += step_s
                due[number] = clock.now_s + pace.delay_s(1, worked[number])
        clock.now_s += step_s / 10
    return worked


def test_a_client_that_is_alone_may_use_a_whole_processor() -> None:
    [worked] = run_busily(1, 20)
    assert worked > 18


@pytest.mark.parametrize("count", [2, 5, 20])
def test_busy_clients_share_a_part_of_the_processor_equally(count: int) -> None:
    worked = run_busily(count, 60)
    assert sum(worked) == pytest.approx(60 * BUSY_SHARE, rel=0.15)
    assert max(worked) < 1.2 * min(worked)


def test_a_client_with_little_work_is_not_delayed_by_busy_ones() -> None:
    clock, work = Clock(), SharedWork()
    busy, other = ReadPace(Limits(), clock, work), ReadPace(Limits(), clock, work)
    worked = other_worked = 0.0
    for _ in range(500):
        worked += 0.02
        other_worked += 0.001
        clock.now_s += 0.02
        busy.delay_s(1, worked)
        assert other.delay_s(1, other_worked) == 0
