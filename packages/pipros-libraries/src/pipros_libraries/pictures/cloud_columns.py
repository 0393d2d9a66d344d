"""Extract columns of numbers from the rows of a `sensor_msgs/PointCloud2`, without numpy.

A browser draws points from planar columns: x, y, z, and the fields that determine colours. To stay within the
browser's limit, only every k-th point is sent. The first point varies from message to message, so all points
of a static cloud are shown in turn.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

SIZES: Final = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8}
"""Sizes in bytes by `PointField.datatype`: INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64."""

FLOAT32: Final = 7
POSITION: Final = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Column:
    """The values of one field of a cloud.

    Attributes:
        datatype: as in `sensor_msgs/PointField`.
        data: values of the chosen points, in the byte order of the cloud.
    """

    name: str
    datatype: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Columns:
    """The columns read from one cloud.

    Attributes:
        count: number of points in the cloud.
        step: distance between chosen points; 1 if all were chosen.
        problem: error text if the cloud cannot be shown (rviz's text if the data size is wrong); otherwise
            empty.
    """

    count: int
    step: int
    columns: tuple[Column, ...]
    problem: str = ""


def thinning_step(count: int, limit: int) -> int:
    """Return the smallest odd k such that taking every k-th of `count` points yields at most `limit` points.

    With an even k, whole rings would be missing in clouds from a lidar that interleaves the points of an even
    number of rings.

    >>> thinning_step(100, 100), thinning_step(200, 100), thinning_step(1000, 90)
    (1, 3, 13)
    """
    step = -(-count // max(limit, 1))
    return step + 1 if step > 1 and step % 2 == 0 else max(step, 1)


def cloud_columns(cloud: Any, wanted: Sequence[str], limit: int, turn: int = 0) -> Columns:
    """Return the columns x, y and z, and the columns in `wanted` that the cloud has.

    If the cloud cannot be shown, the result has no columns, and `problem` is set.

    Args:
        limit: maximum number of points.
        turn: sequential number of the message, which determines the first point.
    """
    count, size = cloud.width * cloud.height, cloud.point_step
    expected = count * size
    if len(cloud.data) != expected:
        problem = (
            f"Data size ({len(cloud.data)} bytes) does not match width ({cloud.width}) times height "
            f"({cloud.height}) times point_step ({size}).  Dropping message."
        )
        return Columns(count, 1, (), problem)
    fields = {field.name: field for field in cloud.fields}
    if any(fields[name].datatype != FLOAT32 if name in fields else True for name in POSITION):
        return Columns(count, 1, (), "the fields x, y and z must exist and be of type FLOAT32")
    step = thinning_step(count, limit)
    first = turn % step
    columns = []
    for name in dict.fromkeys([*POSITION, *wanted]):
        field = fields.get(name)
        width = SIZES.get(field.datatype, 0) if field is not None else 0
        if field is None or not width or field.offset + width > size:
            if name in POSITION:
                return Columns(count, 1, (), f"the field {name} lies outside its point")
            continue
        data = strided(cloud.data, first * size + field.offset, step * size, width)
        columns.append(Column(name, field.datatype, data))
    return Columns(count, step, tuple(columns))


def point_columns(cloud: Any, wanted: Sequence[str], limit: int, turn: int = 0) -> Columns:
    """Return the columns of a `sensor_msgs/PointCloud`, like `cloud_columns`. Its channels are the fields."""
    count = len(cloud.points)
    step = thinning_step(count, limit)
    chosen = range(turn % step, count, step)
    values = {name: [getattr(cloud.points[at], name) for at in chosen] for name in POSITION}
    for channel in cloud.channels:
        if channel.name in wanted:
            if len(channel.values) != count:
                problem = f"Channel [{channel.name}] has {len(channel.values)} values for {count} points"
                return Columns(count, 1, (), problem)
            values[channel.name] = [channel.values[at] for at in chosen]
    return Columns(
        count, step, tuple(Column(name, FLOAT32, array("f", row).tobytes()) for name, row in values.items())
    )


def strided(data: bytes | memoryview, offset: int, step: int, width: int) -> bytes:
    """Concatenate the `width` bytes at each of the positions `offset`, `offset + step`, ….

    The n-th bytes of all values are copied by one slice, so that alignment does not matter.

    >>> strided(b"0123456789ab", 1, 4, 2)
    b'12569a'
    """
    first = data[offset::step]
    found = bytearray(len(first) * width)
    found[::width] = first
    for at in range(1, width):
        found[at::width] = data[offset + at :: step][: len(first)]
    return bytes(found)
