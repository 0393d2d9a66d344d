"""Figures of a topic statistics window, and the adaptation of its length to the traffic."""

from types import SimpleNamespace
from typing import Any

import pytest

from pipros.node.statistics_publisher import StatisticsPublisher
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


# Statistics publisher


class Published:
    def __init__(self) -> None:
        self.messages: list[Any] = []

    def publish(self, message: Any) -> None:
        message._to_buffers()  # every field keeps its value
        self.messages.append(message)


def arrivals(published: Published, count: int, *, stamp_ns: int, step: int) -> None:
    now = [0]
    statistics = StatisticsPublisher(
        "/listener", lambda *_, **__: published, lambda: now[0], WindowLimits(), max_links=10
    )
    for number in range(count):
        now[0] += 500_000_000
        stamp = SimpleNamespace(to_nsec=lambda: stamp_ns)
        header = SimpleNamespace(seq=1 + number % 2 * step, stamp=stamp)
        statistics.arrived(
            "/chat", {"callerid": "/talker"}, 2**31, SimpleNamespace(_has_header=True, header=header)
        )


def test_figures_beyond_the_range_of_their_fields_are_clamped() -> None:
    published = Published()
    arrivals(published, 10, stamp_ns=2**32 * 1_000_000_000, step=2**32 - 2)
    first = published.messages[0]
    assert (first.dropped_msgs, first.traffic) == (2**31 - 1, 2**31 - 1)
    assert first.stamp_age_mean.secs == -(2**31) + 1


def test_the_number_of_remembered_links_is_bounded() -> None:
    published = Published()
    statistics = StatisticsPublisher(
        "/listener", lambda *_, **__: published, lambda: 1, WindowLimits(), max_links=10
    )
    for number in range(1000):
        statistics.arrived("/chat", {"callerid": f"/talker_{number}"}, 1, SimpleNamespace())
    assert len(statistics._meters) == 10
    assert ("/chat", "/talker_999") in statistics._meters
