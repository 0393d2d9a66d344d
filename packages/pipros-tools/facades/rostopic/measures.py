"""Topic statistics, with `callback…` methods to pass to subscribers."""

from __future__ import annotations

import threading
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import rospy
from pipros_tools.graph import measurements as _text
from pipros_tools.graph.samples import DEFAULT_WINDOW, SampleFigures, Samples


def _window(size: int) -> int:
    return size if size >= 0 else DEFAULT_WINDOW


def _figures(values: Sequence[float]) -> SampleFigures | None:
    samples = Samples(len(values))
    for value in values:
        samples.add(value)
    return samples.figures()


class ROSTopicHz:
    """Message rates of topics. Subscribe with `callback_hz`, passing the topic as `callback_args`.

    Times are in seconds on the node's clock, or in wall time if `use_wtime` is set. Methods called without a
    topic refer to a single, unnamed topic.

    Attributes:
        times: intervals between messages; `msg_t0` and `msg_tn` are the times of the first and last arrival.
        last_printed_tn: time of the last arrival that `get_hz` or `print_hz` reported.
        lock: protects these attributes.
    """

    def __init__(
        self, window_size: int, filter_expr: Callable[[Any], bool] | None = None, use_wtime: bool = False
    ) -> None:
        self.lock = threading.Lock()
        self.last_printed_tn: float = 0
        self.msg_t0: float = -1
        self.msg_tn: float = 0
        self.times: list[float] = []
        self._last_printed_tn: defaultdict[str, float] = defaultdict(int)
        self._msg_t0: defaultdict[str, float] = defaultdict(lambda: -1)
        self._msg_tn: defaultdict[str, float] = defaultdict(int)
        self._times: defaultdict[str, list[float]] = defaultdict(list)
        self.filter_expr = filter_expr
        self.use_wtime = use_wtime
        self.window_size = _window(window_size)

    def get_last_printed_tn(self, topic: str | None = None) -> float:
        return self.last_printed_tn if topic is None else self._last_printed_tn[topic]

    def set_last_printed_tn(self, value: float, topic: str | None = None) -> None:
        if topic is None:
            self.last_printed_tn = value
        else:
            self._last_printed_tn[topic] = value

    def get_msg_t0(self, topic: str | None = None) -> float:
        return self.msg_t0 if topic is None else self._msg_t0[topic]

    def set_msg_t0(self, value: float, topic: str | None = None) -> None:
        if topic is None:
            self.msg_t0 = value
        else:
            self._msg_t0[topic] = value

    def get_msg_tn(self, topic: str | None = None) -> float:
        return self.msg_tn if topic is None else self._msg_tn[topic]

    def set_msg_tn(self, value: float, topic: str | None = None) -> None:
        if topic is None:
            self.msg_tn = value
        else:
            self._msg_tn[topic] = value

    def get_times(self, topic: str | None = None) -> list[float]:
        return self.times if topic is None else self._times[topic]

    def set_times(self, value: list[float], topic: str | None = None) -> None:
        if topic is None:
            self.times = value
        else:
            self._times[topic] = value

    def callback_hz(self, m: Any, topic: str | None = None) -> None:
        """Add a message."""
        if self.filter_expr is not None and not self.filter_expr(m):
            return
        with self.lock:
            now = time.time() if self.use_wtime else rospy.get_time()
            first, last = self.get_msg_t0(topic), self.get_msg_tn(topic)
            if first < 0 or now < last:  # this is the first message, or time has jumped back
                self.set_msg_t0(now, topic)
                self.set_times([], topic)
            else:
                times = self.get_times(topic)
                times.append(now - last)
                del times[: max(len(times) - (self.window_size - 1), 0)]
            self.set_msg_tn(now, topic)

    def get_hz(self, topic: str | None = None) -> tuple[float, float, float, float, int] | None:
        """Return the rate (Hz), the intervals' minimum, maximum and standard deviation, and the window size.

        Return None if fewer than two messages have arrived, or none since the last call.
        """
        figures = self._new_figures(topic)
        if figures is None:
            return None
        rate = 1 / figures.mean if figures.mean > 0 else 0.0
        return rate, figures.minimum, figures.maximum, figures.deviation, figures.count

    def print_hz(self, topics: Sequence[str | None] | None = None) -> None:
        """Print the rates of topics with new messages."""
        requested = (None,) if topics is None else topics
        found = {
            str(topic): figures for topic in requested if (figures := self._new_figures(topic)) is not None
        }
        if not found:
            print(_text.NO_NEW_MESSAGES)
        elif len(requested) == 1:
            print(_text.rate_text(next(iter(found.values()))))
        else:
            print(_text.rate_table(found))

    def _new_figures(self, topic: str | None) -> SampleFigures | None:
        with self.lock:
            last = self.get_msg_tn(topic)
            if not self.get_times(topic) or last == self.get_last_printed_tn(topic):
                return None
            self.set_last_printed_tn(last, topic)
            figures = _figures(self.get_times(topic))
        if figures is None:
            return None
        return SampleFigures(
            figures.mean, figures.minimum, figures.maximum, figures.deviation, figures.count + 1
        )


class ROSTopicBandwidth:
    """Bandwidth of a topic. Subscribe with `callback` and the message class `rospy.AnyMsg`.

    Attributes:
        sizes, times: sizes (bytes) and times of arrival (s) of the most recent messages.
        last_printed_tn: time of the last arrival that was printed.
        lock: protects these attributes.
    """

    def __init__(self, window_size: int = _text.BANDWIDTH_WINDOW) -> None:
        self.lock = threading.Lock()
        self.last_printed_tn: float = 0
        self.sizes: list[int] = []
        self.times: list[float] = []
        self.window_size = window_size or _text.BANDWIDTH_WINDOW

    def callback(self, data: Any) -> None:
        """Add an undecoded message."""
        with self.lock:
            self.times.append(time.time())
            self.sizes.append(len(data._buff))
            excess = max(len(self.times) - self.window_size, 0)
            del self.times[:excess], self.sizes[:excess]

    def print_bw(self) -> None:
        """Print the bandwidth, if at least two messages have arrived."""
        with self.lock:
            now = time.time()
            if len(self.times) < 2 or now <= self.times[0]:
                return
            self.last_printed_tn = self.times[-1]
            figures = _figures(self.sizes)
            bytes_per_s = sum(self.sizes) / (now - self.times[0])
        if figures is not None:
            print(_text.bandwidth_text(bytes_per_s, figures))


class ROSTopicDelay:
    """Age of a topic's messages on arrival. Subscribe with `callback_delay`.

    Attributes:
        delays: delays of the most recent messages, in seconds.
        msg_t0, msg_tn, last_msg_tn: times of the first, the last and the last reported arrival.
        lock: protects these attributes.
    """

    def __init__(self, window_size: int) -> None:
        self.lock = threading.Lock()
        self.last_msg_tn: float = 0
        self.msg_t0: float = -1.0
        self.msg_tn: float = 0
        self.delays: list[float] = []
        self.window_size = _window(window_size)

    def callback_delay(self, msg: Any) -> None:
        """Add a message. A message without a header is logged as an error."""
        if not msg._has_header:
            rospy.logerr("msg does not have header")
            return
        with self.lock:
            now = rospy.get_time()
            if self.msg_t0 < 0 or now < self.msg_tn:
                self.msg_t0 = now
                self.delays = []
            self.msg_tn = now
            self.delays.append(now - msg.header.stamp.to_sec())
            del self.delays[: max(len(self.delays) - self.window_size, 0)]

    def get_delay(self) -> tuple[float, float, float, float, int] | None:
        """Return the mean, minimum, maximum and standard deviation of the delays (s), and the window size.

        Return None if no message has arrived since the last call.
        """
        figures = self._new_figures()
        if figures is None:
            return None
        return figures.mean, figures.minimum, figures.maximum, figures.deviation, figures.count

    def print_delay(self) -> None:
        """Print the delay."""
        figures = self._new_figures()
        print(_text.NO_NEW_MESSAGES if figures is None else _text.delay_text(figures))

    def _new_figures(self) -> SampleFigures | None:
        with self.lock:
            if not self.delays or self.msg_tn == self.last_msg_tn:
                return None
            self.last_msg_tn = self.msg_tn
            return _figures(self.delays)
