from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from pipros.node.statistics_publisher import StatisticsPublisher
from pipros.node.topic_statistics import WindowLimits


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
