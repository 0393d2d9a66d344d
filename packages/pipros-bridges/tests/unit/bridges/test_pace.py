"""Rate limits for the messages of one client."""

from __future__ import annotations

import pytest

from pipros.basics.limits import Limits
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.pace import BURST_S, ReadPace

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
