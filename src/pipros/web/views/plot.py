"""Live curves of numeric fields in messages, as in `rqt_plot`."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import time
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.graph.message_path import PathStep, extract, parse_path
from pipros.msg.time import TVal
from pipros.node.any_msg import AnyMsg
from pipros.web.server import RequestRefused
from pipros.web.topic_watch import NewSamples, TopicWatch
from pipros.web.watched_system import WatchedSystem

SEND_INTERVAL_S = 0.1
KEPT_SAMPLES = 5000
"""Maximum number of samples queued for a slow browser."""
MOST_FIELDS = 100
"""Maximum number of fields suggested for a topic."""
MOST_ELEMENTS = 10
"""Maximum number of elements of one array among the suggested fields."""
DECODED_A_SECOND = 2000
"""Maximum number of messages per second decoded for one curve. Further messages count as lost."""


@dataclass(frozen=True, slots=True)
class Field:
    """Numeric field in the messages of a topic: `/imu/linear_acceleration/x`."""

    topic: str
    path: Sequence[PathStep]
    text: str


def expand(text: str) -> Iterator[str]:
    """Yield the fields named by one argument of `rqt_plot`: `/a/pose/x:y:z` names three.

    >>> list(expand("/a/pose/x:y")), list(expand("/b/data"))
    (['/a/pose/x', '/a/pose/y'], ['/b/data'])
    """
    first, *others = text.split(":") if "[" not in text else [text]
    yield first
    for other in others:
        yield f"{first.rpartition('/')[0]}/{other}"


def find_field(text: str, topics: Mapping[str, str]) -> Field | None:
    """Return the field that `text` denotes, or None. The longest matching topic name counts.

    Raises:
        InvalidIndex: the brackets are malformed.
    """
    words = text.split("/")
    for end in range(len(words), 1, -1):
        topic = "/".join(words[:end])
        if topic in topics:
            return Field(topic, parse_path("/".join(words[end:])), text)
    return None


class NotANumber(ValueError):
    """The field is not a number.

    Attributes:
        fields: paths of the numbers inside the field, relative to it.
    """

    def __init__(self, text: str, fields: Sequence[str]) -> None:
        super().__init__(text)
        self.fields = fields


class PlotViews:
    """The view of the Plot tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def plot(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the samples of one curve, as wall times (s) and values, at most ten times per second."""
        text = arguments.get("field")
        if not isinstance(text, str) or not text.startswith("/") or len(text) > 1000:
            raise RequestRefused(
                f"field must be a topic and a field such as /imu/orientation/x, got {text!r}"
            )
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
        with self._system.topics.watch(field.topic) as watch:
            curve = _Curve(watch, field)
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


class _Curve:
    """Decodes samples in the link's thread, and stores the last error with a list of the valid fields."""

    def __init__(self, watch: TopicWatch, field: Field) -> None:
        self.samples = NewSamples(KEPT_SAMPLES)
        self.error = ""
        self.fields: Sequence[str] = ()
        self._watch = watch
        self._field = field
        self._second = 0
        self._decoded = 0

    def add(self, message: AnyMsg, wall_s: float) -> None:
        second = int(time.monotonic())
        if second != self._second:
            self._second, self._decoded = second, 0
        self._decoded += 1
        if self._decoded > DECODED_A_SECOND:
            self.samples.lose()
            return
        try:
            value = number_in(self._watch.decode(message), self._field)
        except (PiprosError, ValueError) as error:
            self.error = str(error)
            self.fields = error.fields if isinstance(error, NotANumber) else ()
            return
        self.error, self.fields = "", ()
        self.samples.add([round(wall_s, 4), value])


def number_in(message: Any, field: Field) -> float | None:
    """Return the value of a field, or None for NaN and infinity, which interrupt the curve.

    Raises:
        NotANumber: the field is not a number.
        ValueError: an index is out of range.
    """
    from pipros.web.views.topics import percentage

    try:
        value = extract(message, field.path).value
    except (IndexError, TypeError):  # the index is out of range, or the field is not an array
        raise ValueError(f"the message has no element {field.text}") from None
    if isinstance(value, bool):
        return float(value)
    if isinstance(value, TVal):
        return float(value.to_sec())
    if not field.path or isinstance(value, str):
        level = percentage(message)
        if level is not None:
            return level
        slots: Sequence[str] = getattr(value, "__slots__", ())
        if len(slots) == 1:  # std_msgs/Float64 and similar types
            value = getattr(value, slots[0])
    if not isinstance(value, (int, float)):
        found = list(itertools.islice(numeric_fields(value), MOST_FIELDS))
        raise NotANumber(f"{field.text} must be a number, got {type(value).__name__}", found)
    number = float(value)
    return number if number - number == 0.0 else None


def numeric_fields(value: Any, path: str = "") -> Iterator[str]:
    """Yield the paths of the numbers in a message or array: `orientation/x`, `ranges[0]`."""
    if isinstance(value, (int, float, TVal)):
        yield path
    elif hasattr(value, "_slot_types"):
        for name in value.__slots__:
            yield from numeric_fields(getattr(value, name), f"{path}/{name}" if path else name)
    elif isinstance(value, (list, tuple)) or hasattr(value, "tolist"):
        for index in range(min(len(value), MOST_ELEMENTS)):
            item = value[index]
            yield from numeric_fields(item.item() if hasattr(item, "item") else item, f"{path}[{index}]")
