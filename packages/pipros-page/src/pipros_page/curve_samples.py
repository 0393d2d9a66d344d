"""Samples for plots: numeric message fields, or values of expressions over messages, with their times."""

from __future__ import annotations

import enum
import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from pipros.msg.time import Time, TVal
from pipros_libraries.transforms.pose import roll_pitch_yaw
from pipros_tools.bag.filter_expression import MessageExpression
from pipros_tools.graph.message_path import NotAnArray, PathStep, extract, parse_path
from pipros_tools.graph.message_tree import EXACT

MAX_FIELDS = 100
"""Maximum number of fields suggested for a topic."""
MAX_ELEMENTS = 10
"""Maximum number of elements of one array among the suggested fields."""
LOWEST_MARKED_LEVEL: Final = 4
"""Lowest level of the log entries that get a marker in plots: warnings."""
_LONGEST_MARK: Final = 200
_LARGEST: Final = 2**64
"""Larger integers, which only expressions have, are plotted like other numbers."""
_CONDITION: Final = re.compile(
    r"""([^{=]+)\{(?!\})([^{}'"]*(?:(?:'[^']*'|"[^"]*")[^{}'"]*){0,99})\}((?:[/=].*)?)""", re.DOTALL
)
_ANGLES: Final = ("roll_deg", "pitch_deg", "yaw_deg")
"""Angles in degrees that can be plotted for a quaternion, besides its fields."""
_QUATERNION: Final = "geometry_msgs/Quaternion"


class Axis(enum.Enum):
    """Time that the horizontal axis of a plot shows.

    Attributes:
        RECEIVED: when the message arrived, by this machine's clock; in a bag, when it was recorded.
        STAMP: the stamp in the message's header.
        ROS: when the message arrived, in ROS time, which `/clock` may simulate.
    """

    RECEIVED = "received"
    STAMP = "stamp"
    ROS = "ros"


@dataclass(frozen=True, slots=True)
class CurveField:
    """Numeric field in the messages of a topic, such as `/imu/linear_acceleration/x`, or an expression.

    Attributes:
        expression: computes the number; None for a plain field.
        condition: messages that do not satisfy it are left out; None for no condition.
    """

    topic: str
    path: Sequence[PathStep]
    text: str
    expression: MessageExpression | None = None
    condition: MessageExpression | None = None

    @property
    def has_expression(self) -> bool:
        """Whether a user's expression is evaluated for each message."""
        return self.expression is not None or self.condition is not None

    def holds(self, message: object) -> bool:
        """Return whether the condition is true for a message. Raise `ExpressionError` if evaluation fails."""
        return self.condition is None or bool(self.condition.value(self.topic, message, Time()))


def find_field(text: str, topics: Mapping[str, str]) -> CurveField | None:
    """Return the field that `text` denotes, or None if `text` does not begin with the name of a topic.

    If several topic names match, the longest name is chosen.

    `/cmd_vel=hypot(m.linear.x, m.linear.y)` is an expression over the message `m` of the topic before `=`.
    `/pose{m.header.frame_id == "map"}/pose/position/x` has a condition over the message.

    Raises:
        InvalidIndex: the brackets are malformed.
        ExpressionError: the expression or the condition is malformed.
    """
    if conditional := _CONDITION.fullmatch(text):
        topic, condition, rest = conditional.groups()
        found = find_field(topic + rest, {topic: topics[topic]}) if topic in topics else None
        return found and replace(found, text=text, condition=MessageExpression(condition))
    topic, equals, expression = text.partition("=")
    if equals:
        return CurveField(topic, (), text, MessageExpression(expression)) if topic in topics else None
    words = text.split("/")
    for end in range(len(words), 1, -1):
        topic = "/".join(words[:end])
        if topic in topics:
            return CurveField(topic, parse_path("/".join(words[end:])), text)
    return None


class NotANumber(ValueError):
    """The field is not a number.

    Attributes:
        fields: paths of the numeric fields inside the field, relative to the field.
    """

    def __init__(self, text: str, fields: Sequence[str]) -> None:
        super().__init__(text)
        self.fields = fields


def sample_of(
    message: object, field: CurveField, axis: Axis, received_s: float, ros_s: float
) -> list[float | str | None]:
    """Return the time and the value of a sample, and the text of an integer that JavaScript would round.

    Raises:
        ValueError: the axis shows stamps, and the message has none. For other errors, see `number_in`.
    """
    time_s, number = time_of(message, field.topic, axis, received_s, ros_s), number_in(message, field)
    if isinstance(number, int):
        return [time_s, float(number), str(number)]
    return [time_s, number]


def time_of(message: object, topic: str, axis: Axis, received_s: float, ros_s: float) -> float:
    """Return a message's time on an axis, in seconds.

    Raises:
        ValueError: the axis shows stamps, and the message has none.
    """
    if axis is Axis.STAMP:
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        if not isinstance(stamp, Time):
            raise ValueError(f"messages on {topic} have no header; choose another x axis")
        return round(stamp.to_sec(), 6)
    return round(ros_s if axis is Axis.ROS else received_s, 4)


def mark_of(entry: Any, axis: Axis, received_s: float, ros_s: float) -> list[Any] | None:
    """Return the time, level and text of a log entry's marker in a plot, or None if its level is too low."""
    if entry.level < LOWEST_MARKED_LEVEL:
        return None
    time_s = time_of(entry, "/rosout", axis, received_s, ros_s)
    return [time_s, entry.level, f"{entry.name}: {entry.msg}"[:_LONGEST_MARK]]


def _plotted(value: float) -> float | int | None:
    """Return an integer that JavaScript would round as it is, None for NaN and infinity."""
    if isinstance(value, int) and EXACT < abs(value) < _LARGEST:
        return value
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _number_of(expression: MessageExpression, message: object, field: CurveField) -> float | int | None:
    value = expression.value(field.topic, message, Time())
    if not isinstance(value, (bool, int, float)):
        raise NotANumber(f"{field.text} must be a number, got {type(value).__name__}", ())
    return _plotted(value)


def number_in(message: Any, field: CurveField) -> float | int | None:
    """Return the value of a field, or None for NaN and infinity, which leave a gap in the plot.

    Integers that JavaScript would round are not converted to `float`.

    Raises:
        NotANumber: the field is not a number.
        ExpressionError: an expression cannot be evaluated.
        ValueError: an index is out of range, or the indexed field is not an array.
    """
    from pipros_page.views.topics import percentage

    if field.expression is not None:
        return _number_of(field.expression, message, field)
    try:
        if field.path and field.path[-1].text in _ANGLES:
            quaternion = extract(message, field.path[:-1]).value
            if getattr(quaternion, "_type", "") == _QUATERNION:
                return _angle_of(quaternion, _ANGLES.index(field.path[-1].text))
        value = extract(message, field.path).value
    except (IndexError, NotAnArray):  # an index is out of range, or its field is not an array
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
        found = list(itertools.islice(numeric_fields(value), MAX_FIELDS))
        raise NotANumber(f"{field.text} must be a number, got {type(value).__name__}", found)
    return _plotted(value)


def _angle_of(quaternion: Any, index: int) -> float | None:
    values = (quaternion.x, quaternion.y, quaternion.z, quaternion.w)
    size = sum(value * value for value in values)
    if not 0.0 < size < math.inf:
        return None
    return math.degrees(roll_pitch_yaw((0.0, 0.0, 0.0, *values))[index])


def numeric_fields(value: Any, path: str = "") -> Iterator[str]:
    """Yield the paths of the numbers in a message or array, such as `orientation/x` and `ranges[0]`.

    For a quaternion, also yield the paths of the roll, pitch and yaw in degrees.
    """
    if isinstance(value, (int, float, TVal)):
        yield path
    elif hasattr(value, "_slot_types"):
        for name in value.__slots__:
            yield from numeric_fields(getattr(value, name), f"{path}/{name}" if path else name)
        if getattr(value, "_type", "") == _QUATERNION:
            yield from (f"{path}/{name}" if path else name for name in _ANGLES)
    elif isinstance(value, (list, tuple)) or hasattr(value, "tolist"):
        for index in range(min(len(value), MAX_ELEMENTS)):
            item = value[index]
            yield from numeric_fields(item.item() if hasattr(item, "item") else item, f"{path}[{index}]")
