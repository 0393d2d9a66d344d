"""Live plots of numeric message fields, as in `rqt_plot`, with markers for log entries."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.node.any_msg import AnyMsg
from pipros_page.curve_samples import Axis, CurveField, NotANumber, find_field, mark_of, sample_of
from pipros_page.messages.known_topic import KnownTopic
from pipros_page.new_samples import NewSamples
from pipros_page.topic_watch import TopicWatch
from pipros_page.views.console import LOG_TOPIC
from pipros_page.watched_system import WatchedSystem
from pipros_server.browser_share import SpentTime, browser_or_none
from pipros_server.view_server import RequestRefused

SEND_INTERVAL_S = 0.1
KEPT_SAMPLES = 5000
"""Maximum number of samples queued for a slow browser."""
KEPT_MARKS = 500
DECODED_A_SECOND = 2000
"""Maximum number of messages per second decoded for one plotted field. Further messages count as lost."""
COMPUTED_S = 0.2
"""Maximum processor time per second spent on one plotted field. Further messages count as lost.

If a single sample of an expression takes longer, its plot ends, because browsers may send any expression.
This also applies to plots of whole bags.
"""
COMPUTED_OF_A_BROWSER_S = 0.5
"""Maximum processor time per second spent on all plotted fields of a browser."""
CLOCK_TOPIC = "/clock"


def field_text(arguments: Mapping[str, object]) -> str:
    """Return the argument `field`. Raise `RequestRefused` if it is invalid."""
    text = arguments.get("field")
    if not isinstance(text, str) or not text.startswith("/") or len(text) > 1000:
        raise RequestRefused(f"field must be a topic and a field such as /imu/orientation/x, got {text!r}")
    return text


def axis_of(arguments: Mapping[str, object]) -> Axis:
    """Return the argument `axis`, which defaults to `RECEIVED`. Raise `RequestRefused` if it is invalid."""
    try:
        return Axis(arguments.get("axis", Axis.RECEIVED.value))
    except ValueError:
        names = ", ".join(each.value for each in Axis)
        raise RequestRefused(f"axis must be one of {names}, got {arguments['axis']!r:.100}") from None


class PlotViews:
    """The views of the Plot tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def plot(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the samples of one plotted field, as times (s) and values, at most ten times per second."""
        text, axis = field_text(arguments), axis_of(arguments)
        field = None
        observations = self._system.observations()
        async with contextlib.aclosing(observations):  # type: ignore[type-var]
            async for observation in observations:
                field = find_field(text, observation.types)
                if field is not None:
                    break
                yield {"error": f"the topic of {text} is not published yet"}
        if field is None:  # the server is shutting down
            return
        yield {"topic": field.topic}
        with self._system.topics.watch(field.topic) as watch, self._ros_time(axis) as ros_time:
            curve = _Curve(watch, field, axis, ros_time)
            with watch.listening(curve.add):
                while True:
                    samples, lost = curve.samples.pop_all()
                    if samples or lost or curve.error:
                        yield {
                            "samples": samples,
                            "lost": lost,
                            "error": curve.error,
                            "fields": curve.fields,
                        }
                    await asyncio.sleep(SEND_INTERVAL_S)

    async def log_marks(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the warnings and errors in the log as times (s), levels and texts."""
        axis, marks = axis_of(arguments), NewSamples(KEPT_MARKS)
        with self._system.topics.watch(LOG_TOPIC) as watch, self._ros_time(axis) as ros_time:

            def take(entry: object, _: AnyMsg, received_s: float) -> None:
                mark = mark_of(entry, axis, received_s, ros_time.at(received_s))
                if mark is not None:
                    marks.add(mark)

            with KnownTopic(watch, "rosgraph_msgs/Log", take).listening():
                while True:
                    found, lost = marks.pop_all()
                    if found or lost:
                        yield {"marks": found, "lost": lost}
                    await asyncio.sleep(SEND_INTERVAL_S)

    @contextlib.contextmanager
    def _ros_time(self, axis: Axis) -> Iterator[_RosTime]:
        ros_time = _RosTime()
        if axis is not Axis.ROS or not self._system.is_live:  # a bag stores the ROS time of each message
            yield ros_time
            return
        with (
            self._system.topics.watch(CLOCK_TOPIC) as watch,
            KnownTopic(watch, "rosgraph_msgs/Clock", ros_time.set).listening(),
        ):
            yield ros_time


class _RosTime:
    """The newest time from `/clock`; until a time is received, each message's time of arrival."""

    def __init__(self) -> None:
        self._clock_s: float | None = None

    def set(self, message: Any, _raw: AnyMsg, _received_s: float) -> None:
        self._clock_s = message.clock.to_sec()

    def at(self, received_s: float) -> float:
        return received_s if self._clock_s is None else self._clock_s


class _Curve:
    """Decodes samples in the thread that receives them, and stores the last error and the valid fields."""

    def __init__(self, watch: TopicWatch, field: CurveField, axis: Axis, ros_time: _RosTime) -> None:
        self.samples = NewSamples(KEPT_SAMPLES)
        self.error = ""
        self.fields: Sequence[str] = ()
        self._watch = watch
        self._field = field
        self._axis = axis
        self._ros_time = ros_time
        self._second = 0
        self._decoded = 0
        self._spent_s = 0.0
        browser = browser_or_none()
        self._of_browser = SpentTime() if browser is None else browser.plotting
        self._is_over = False

    def add(self, message: AnyMsg, wall_s: float) -> None:
        second, begin_s = int(time.monotonic()), time.thread_time()
        if second != self._second:
            self._second, self._decoded, self._spent_s = second, 0, 0.0
        self._decoded += 1
        is_busy = self._spent_s > COMPUTED_S or self._of_browser.add(0.0) > COMPUTED_OF_A_BROWSER_S
        if self._is_over or self._decoded > DECODED_A_SECOND or is_busy:
            self.samples.lose()
            return
        try:
            decoded = self._watch.decode(message)
            if not self._field.holds(decoded):
                return
            sample = sample_of(decoded, self._field, self._axis, wall_s, self._ros_time.at(wall_s))
        except (PiprosError, ValueError) as error:
            self.error = str(error)
            self.fields = error.fields if isinstance(error, NotANumber) else ()
            return
        finally:
            sample_s = time.thread_time() - begin_s
            self._spent_s += sample_s
            self._of_browser.add(sample_s)
            if sample_s > COMPUTED_S and self._field.has_expression:
                self._is_over = True
                self.error = (
                    f"{self._field.text}: a sample takes {sample_s:.1f} s, and the limit is {COMPUTED_S} s"
                )
        if self._is_over:
            return
        self.error, self.fields = "", ()
        self.samples.add(sample)
