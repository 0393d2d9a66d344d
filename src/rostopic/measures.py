"""The measuring classes that code subscribes with: their `callback…` methods take messages."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import rospy
from pipros.graph import measurements as _text
from pipros.graph.samples import DEFAULT_WINDOW, BandwidthWindow, Figures, RateWindow, Samples


def _window(size: int) -> int:
    return size if size >= 0 else DEFAULT_WINDOW


class ROSTopicHz:
    """The rates of topics. Subscribe with `callback_hz`, and the topic as `callback_args`."""

    def __init__(
        self, window_size: int, filter_expr: Callable[[Any], bool] | None = None, use_wtime: bool = False
    ) -> None:
        self._window = _window(window_size)
        self._passes = filter_expr
        self._now = time.time if use_wtime else rospy.get_time
        self._rates: dict[str | None, RateWindow] = {}

    def callback_hz(self, m: Any, topic: str | None = None) -> None:
        """Takes over a message."""
        if self._passes is None or self._passes(m):
            self._rates.setdefault(topic, RateWindow(self._window)).add(self._now())

    def get_hz(self, topic: str | None = None) -> tuple[float, float, float, float, int] | None:
        """Rate, shortest and longest interval, deviation and window; None without a new message."""
        figures = self._news(topic)
        if figures is None:
            return None
        return 1 / figures.mean, figures.minimum, figures.maximum, figures.deviation, figures.count

    def print_hz(self, topics: Sequence[str | None] = (None,)) -> None:
        """Prints what is new."""
        found = {str(topic): figures for topic in topics if (figures := self._news(topic)) is not None}
        if not found:
            print(_text.NO_NEW_MESSAGES)
        elif len(topics) == 1:
            print(_text.rate_text(next(iter(found.values()))))
        else:
            print(_text.rate_table(found))

    def _news(self, topic: str | None) -> Figures | None:
        rate = self._rates.get(topic)
        return rate.figures() if rate is not None and rate.has_new else None


class ROSTopicBandwidth:
    """The bandwidth of a topic. Subscribe with `callback`, as `rospy.AnyMsg`."""

    def __init__(self, window_size: int = _text.BANDWIDTH_WINDOW) -> None:
        self._bandwidth = BandwidthWindow(window_size)

    def callback(self, data: Any) -> None:
        """Takes over an undecoded message."""
        self._bandwidth.add(time.monotonic(), len(data._buff))

    def print_bw(self) -> None:
        """Prints the figures, once there are two messages."""
        figures = self._bandwidth.figures(time.monotonic())
        if figures is not None:
            print(_text.bandwidth_text(*figures))


class ROSTopicDelay:
    """How old the messages of a topic are. Subscribe with `callback_delay`."""

    def __init__(self, window_size: int) -> None:
        self._delays_s = Samples(_window(window_size))

    def callback_delay(self, msg: Any) -> None:
        """Takes over a message; one without a header is complained about."""
        if not msg._has_header:
            rospy.logerr("msg does not have header")
            return
        self._delays_s.add(rospy.get_time() - msg.header.stamp.to_sec())

    def get_delay(self) -> tuple[float, float, float, float, int] | None:
        """Mean, shortest and longest delay, deviation and window, in seconds; None without a message."""
        figures = self._delays_s.figures()
        if figures is None:
            return None
        return figures.mean, figures.minimum, figures.maximum, figures.deviation, figures.count

    def print_delay(self) -> None:
        """Prints the figures."""
        figures = self._delays_s.figures()
        print(_text.NO_NEW_MESSAGES if figures is None else _text.delay_text(figures))
