"""Figures of a topic statistics window, and the adaptation of its length to the traffic."""

from __future__ import annotations

import pytest

from pipros.node.topic_statistics import StatisticsWindow, TrafficMeter, WindowLimits

S = 1_000_000_000


def run(meter: TrafficMeter, seconds: float, rate: int, start_ns: int = S) -> list[StatisticsWindow]:
    """Feed a steady stream of messages of 10 bytes, each a millisecond old."""
    windows = []
    for number in range(int(seconds * rate)):
        now_ns = start_ns + number * S // rate
        if window := meter.add(now_ns, 10, number, now_ns - 1_000_000):
            windows.append(window)
    return windows


def test_a_steady_stream_is_described() -> None:
    window = run(TrafficMeter(), 1.1, 20)[0]
    assert (window.delivered, window.dropped, window.bytes) == (21, 0, 210)
    assert window.period_mean_s == pytest.approx(0.05)
    assert window.period_stddev_s == pytest.approx(0)
    assert (window.age_mean_s, window.age_max_s) == (pytest.approx(0.001), pytest.approx(0.001))
    assert (window.start_ns, window.stop_ns) == (S, 2 * S)


def test_gaps_in_the_sequence_are_dropped_messages() -> None:
    meter = TrafficMeter()
    for second, sequence in ((1, 1), (1, 2), (1, 5)):
        assert meter.add(second * S, 1, sequence, None) is None
    window = meter.add(2 * S, 1, 6, None)
    assert window is not None
    assert window.dropped == 2
    assert window.age_max_s == 0


def test_a_window_with_too_few_messages_grows_up_to_the_limit() -> None:
    meter = TrafficMeter(WindowLimits(min_elements=10, max_size_s=8.0))
    run(meter, 60, 1)
    assert meter.window_s == 8.0


def test_a_window_with_too_many_messages_shrinks() -> None:
    meter = TrafficMeter(WindowLimits(max_elements=100, min_size_s=1.0), window_s=4.0)
    run(meter, 20, 200)
    assert meter.window_s == 1.0


def test_a_window_starts_again_if_the_time_moves_back() -> None:
    meter = TrafficMeter()
    run(meter, 0.5, 20, 100 * S)
    (window,) = run(meter, 1.1, 20)
    assert (window.start_ns, window.delivered) == (S, 21)
