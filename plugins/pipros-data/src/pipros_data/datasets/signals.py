"""Read the numbers of a topic and the times by which they are aligned."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.limits import limit_text, process_limits
from pipros.basics.similar_names import similar_names
from pipros.msg.bulk.columns import ListColumn, RecordColumn, TextColumn
from pipros.msg.time import NS_PER_S, Time
from pipros.safe.settings import BadSettings
from pipros_data.limits import DataLimits
from pipros_data.table import RECEIPT, STAMP, Table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipros_data.bags import Bags
    from pipros_data.datasets.config import DatasetSource, SignalSource

_TWIST = tuple(f"{part}.{axis}" for part in ("linear", "angular") for axis in "xyz")
_POSE = tuple(f"position.{axis}" for axis in "xyz") + tuple(f"orientation.{axis}" for axis in "xyzw")

USUAL_FIELDS: dict[str, tuple[str, ...]] = {
    "geometry_msgs/Pose": _POSE,
    "geometry_msgs/PoseStamped": tuple(f"pose.{each}" for each in _POSE),
    "geometry_msgs/Twist": _TWIST,
    "geometry_msgs/TwistStamped": tuple(f"twist.{each}" for each in _TWIST),
    "nav_msgs/Odometry": (
        *(f"pose.pose.{each}" for each in _POSE),
        *(f"twist.twist.{each}" for each in _TWIST),
    ),
    "sensor_msgs/Imu": (
        *(f"angular_velocity.{axis}" for axis in "xyz"),
        *(f"linear_acceleration.{axis}" for axis in "xyz"),
    ),
    "sensor_msgs/JointState": ("position",),
    "sensor_msgs/Joy": ("axes", "buttons"),
    **{
        f"std_msgs/{kind}{array}": ("data",)
        for kind in ("Float32", "Float64", "Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32")
        for array in ("", "MultiArray")
    },
    "std_msgs/Bool": ("data",),
}
"""The fields to read if the description lists none, by message type."""


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """The messages of a topic during an episode. Some are dropped so that `times` never decreases."""

    times: NDArray[np.int64]  # the times (ns) by which the kept messages are aligned
    values: NDArray[np.float64]  # one row per kept message
    names: tuple[str, ...]  # names of the numbers in a row
    stamps: NDArray[np.int64]  # stamps of all messages (ns); empty without headers, or if all are 0
    receipts: NDArray[np.int64]  # times of receipt of all messages (ns)
    rows: NDArray[np.int64]  # indices of the kept messages


def read_signal(bags: Bags, source: SignalSource, start: int, end: int) -> RecordedTopic:
    """Read the numbers of a topic that rows from `start` to `end` (ns) may need.

    Raises:
        BadSettings: the description does not fit the bag, or the episode is too large.
        BagError: the bag is damaged.
    """
    left = limit = process_limits().of(DataLimits).table_bytes
    parts: list[NDArray[np.float64]] = []
    times, names = [], source.names
    for table in batches(bags, source, start, end):
        values, names = numbers_of(table, source, names)
        left -= values.nbytes
        if left < 0:
            raise BadSettings(f"{source.place}: the episode is too large: {limit_text('table_bytes', limit)}")
        is_known = ~np.isnan(values).all(axis=1)  # messages that lack a wanted name have only NaN
        if bags.on_bad_message is not None and not source.names and _has_odd_arrays(table, source):
            bags.on_bad_message(table.topic, "an array has another size than most")
        parts.append(values[is_known])
        times.append(times_of(table, source)[is_known])
    check_limits(source, len(names))
    return recorded(times, np.concatenate(parts), names)


def batches(bags: Bags, source: DatasetSource, start: int, end: int) -> Any:
    """Yield tables with the messages that rows from `start` to `end` may need. See `read_signal`."""
    if source.topic not in bags.topics() and not any(source.topic in each.skipped for each in bags.readers):
        hint = similar_names(source.topic, bags.topics()) or f"The topics are {', '.join(bags.topics())}"
        raise BadSettings(f"{source.place}.topic: no bag has {source.topic}. {hint}")
    ahead = round(source.tolerance * NS_PER_S) + NS_PER_S  # stamps may differ from the times of receipt
    first, last = (Time(*divmod(each, NS_PER_S)) for each in (max(0, start - ahead), end + ahead))
    return bags.batches(source.topic, start=first, end=last)


def times_of(table: Table, source: DatasetSource) -> NDArray[np.int64]:
    """Return three columns of times: those used for alignment, the stamps, and the times of receipt.

    Without headers, the stamps are 0.

    Raises:
        BadSettings: the description requires stamps, but the messages have no header.
    """
    receipts = table.times()
    has_header = STAMP in table
    if source.time == "header" and not has_header:
        raise BadSettings(f"{source.place}: {table.type} has no header. Add time: receipt")
    stamps = table.times("header") if has_header else np.zeros(table.rows, np.int64)
    return np.stack([stamps if source.time == "header" else receipts, stamps, receipts], axis=1)


def recorded(
    times: list[NDArray[np.int64]], values: NDArray[np.float64], names: tuple[str, ...]
) -> RecordedTopic:
    """Create a `RecordedTopic`, dropping as few messages as possible so that the times never decrease."""
    joined = np.concatenate(times)
    aligned, stamps, receipts = joined[:, 0], joined[:, 1], joined[:, 2]
    kept = increasing(aligned)
    return RecordedTopic(
        aligned[kept], values[kept], names, stamps if stamps.any() else stamps[:0], receipts, kept
    )


def increasing(times: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices of a longest non-decreasing subsequence, found by patience sorting."""
    if (np.diff(times) >= 0).all():
        return np.arange(len(times))
    ends: list[int] = []  # for each length, the lowest last time of a subsequence
    numbers: list[int] = []  # the indices of these times
    before = np.full(len(times), -1)
    for number, time in enumerate(times.tolist()):
        length = bisect_right(ends, time)
        if length:
            before[number] = numbers[length - 1]
        ends[length : length + 1] = [time]
        numbers[length : length + 1] = [number]
    found = []
    at = numbers[-1]
    while at >= 0:
        found.append(at)
        at = int(before[at])
    return np.array(found[::-1])


def numbers_of(
    table: Table, source: SignalSource, names: tuple[str, ...]
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Return the numbers in each row of a table, in the unit of the description, and their names.

    A message whose array is empty, or has another size than most, has only NaN.

    `names` are the expected names; if they are empty, the names are derived from the fields.

    Raises:
        BadSettings: the description does not fit the type or the messages.
    """
    fields = source.fields or USUAL_FIELDS.get(table.type, ())
    if not fields:
        raise BadSettings(f"{source.place}: {table.type} has no default fields. Name some of {_known(table)}")
    parts, found = [], []
    is_lost = np.zeros(table.rows, bool)
    for field in fields:
        part = _field(table, source, field)
        parts.append(part)
        if isinstance(table[field], ListColumn):
            is_lost |= np.isnan(part).all(axis=1)
        found += [field] if part.shape[1] == 1 else [f"{field}[{n}]" for n in range(part.shape[1])]
    values = np.concatenate(parts, axis=1) * source.scale
    values[is_lost] = np.nan
    if names:
        _check_width(source, values, len(names))
    return values, names or tuple(found)


def _field(table: Table, source: SignalSource, field: str) -> NDArray[np.float64]:
    if field not in table or field == RECEIPT:
        hint = similar_names(field, table) or f"The fields are {_known(table)}"
        raise BadSettings(f"{source.place}.fields: {table.type} has no field {field!r}. {hint}")
    column = table[field]
    if isinstance(column, ListColumn) and isinstance(column.values, np.ndarray):
        labels = table.get("name")
        if source.names and isinstance(labels, ListColumn) and isinstance(labels.values, TextColumn):
            return _by_name(column, labels, source)
        if not len(column):
            return np.zeros((0, max(len(source.names), 1)))
        return _of_usual_size(column)
    if not isinstance(column, np.ndarray) or column.dtype.kind not in "biuf":
        raise BadSettings(f"{source.place}.fields: {field} of {table.type} must be numbers")
    return column.reshape(table.rows, *(column.shape[1:] or (1,))).astype(np.float64)


def _has_odd_arrays(table: Table, source: SignalSource) -> bool:
    columns = [table[each] for each in source.fields or USUAL_FIELDS.get(table.type, ())]
    sizes = [each.sizes[each.sizes > 0] for each in columns if isinstance(each, ListColumn)]
    return any(len(np.unique(each)) > 1 for each in sizes)


def _of_usual_size(column: ListColumn) -> NDArray[np.float64]:
    """Return a row for each cell. Cells whose size differs from that of most get NaN, as empty ones do."""
    sizes, counts = np.unique(column.sizes[column.sizes > 0], return_counts=True)
    usual = sizes[counts.argmax()] if len(sizes) else 0
    is_usual = column.sizes == usual
    found = np.full((len(column), usual), np.nan)
    found[is_usual] = np.asarray(column.take(np.flatnonzero(is_usual)), np.float64)
    return found


def _by_name(column: ListColumn, labels: ListColumn, source: SignalSource) -> NDArray[np.float64]:
    """Return the numbers selected by the description's names. Messages that lack one of them get NaN."""
    found = np.full((len(column), len(source.names)), np.nan)
    places: dict[tuple[bytes, ...], list[int] | None] = {}
    for row, (cell, label) in enumerate(zip(column, labels, strict=True)):
        key = (label.data[label.offsets[0] : label.offsets[-1]].tobytes(), label.sizes.tobytes())
        if key not in places:
            known = list(label)
            has_all = set(source.names) <= set(known)
            places[key] = [known.index(name) for name in source.names] if has_all else None
        place = places[key]
        if place is not None and len(cell) > max(place):
            found[row] = cell[place]
    return found


def _check_width(source: SignalSource, values: NDArray[np.float64], width: int) -> None:
    if len(values) and values.shape[1] != width:
        raise BadSettings(
            f"{source.place}: must have {width} numbers, got {values.shape[1]}. Select other fields"
        )


def check_limits(source: SignalSource, width: int) -> None:
    for key, limits in (("min", source.least), ("max", source.most)):
        if len(limits) not in (0, 1, width):
            raise BadSettings(f"{source.place}.{key}: must be one number or {width}, got {len(limits)}")
    if source.least and source.most and not (np.array(source.least) < source.most).all():
        raise BadSettings(f"{source.place}.min: must be < max, got {source.least} and {source.most}")


def _known(table: Table) -> str:
    return ", ".join(
        name
        for name, column in table.items()
        if name != RECEIPT and not isinstance(column, TextColumn | RecordColumn)
    )
