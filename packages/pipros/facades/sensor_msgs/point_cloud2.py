"""Read points from `sensor_msgs/PointCloud2` messages, and create such messages."""

from __future__ import annotations

import struct
import sys
from collections import namedtuple
from collections.abc import Container, Iterable, Iterator, Sequence
from math import isnan
from typing import Any

from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

_DATATYPES = {
    PointField.INT8: ("b", 1),
    PointField.UINT8: ("B", 1),
    PointField.INT16: ("h", 2),
    PointField.UINT16: ("H", 2),
    PointField.INT32: ("i", 4),
    PointField.UINT32: ("I", 4),
    PointField.FLOAT32: ("f", 4),
    PointField.FLOAT64: ("d", 8),
}


def read_points(
    cloud: PointCloud2,
    field_names: Container[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] = (),
) -> Iterator[tuple[Any, ...]]:
    """Yield the points of a cloud, row by row. Each point is a tuple of values in the order of their offsets.

    Args:
        field_names: the fields to read; None for all fields.
        skip_nans: whether to omit points in which a value is NaN.
        uvs: the column and row of each point to read; empty for all points.

    Raises:
        AssertionError: `cloud` is not a `PointCloud2`.
        struct.error: the data is too short for the cloud's width and height, or for a point in `uvs`.
    """
    _check_is_cloud(cloud)
    layout = _get_struct_fmt(cloud.is_bigendian, cloud.fields, field_names)
    points = _single_points(cloud, layout, uvs) if uvs else _all_points(cloud, layout)
    if not skip_nans:
        yield from points
    else:
        yield from (point for point in points if not any(map(isnan, point)))


def read_points_list(
    cloud: PointCloud2,
    field_names: Container[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] = (),
) -> list[Any]:
    """Like `read_points`, but return a list of named tuples.

    Raises:
        ValueError: the name of a field cannot be a field name of a named tuple.
    """
    _check_is_cloud(cloud)
    names = [field.name for field in _in_order(cloud.fields, field_names)]
    make_class: Any = namedtuple
    point_class = make_class("Point", names)
    return [point_class._make(point) for point in read_points(cloud, names, skip_nans, uvs)]


def create_cloud(
    header: Header, fields: Sequence[PointField], points: Sequence[Sequence[float]]
) -> PointCloud2:
    """Return a cloud with one row. The values of each point must be in the order of the fields' offsets.

    Raises:
        struct.error: a point has the wrong number of values, or a value does not fit its field.
    """
    layout = struct.Struct(_get_struct_fmt(False, fields))
    return PointCloud2(
        header=header,
        height=1,
        width=len(points),
        fields=list(fields),
        is_bigendian=False,
        point_step=layout.size,
        row_step=layout.size * len(points),
        data=b"".join(layout.pack(*point) for point in points),
        is_dense=False,
    )


def create_cloud_xyz32(header: Header, points: Sequence[Sequence[float]]) -> PointCloud2:
    """Return a cloud with one row and the float32 fields x, y and z. Raises the errors of `create_cloud`."""
    fields = [PointField(name, 4 * place, PointField.FLOAT32, 1) for place, name in enumerate("xyz")]
    return create_cloud(header, fields, points)


def _check_is_cloud(cloud: PointCloud2) -> None:
    if getattr(cloud, "_type", None) != PointCloud2._type:
        raise AssertionError("cloud is not a sensor_msgs.msg.PointCloud2")


def _single_points(
    cloud: PointCloud2, layout: str, uvs: Iterable[tuple[int, int]]
) -> Iterator[tuple[Any, ...]]:
    unpack, data = struct.Struct(layout).unpack_from, bytes(cloud.data)
    for column, row in uvs:
        yield unpack(data, row * cloud.row_step + column * cloud.point_step)


def _all_points(cloud: PointCloud2, layout: str) -> Iterator[tuple[Any, ...]]:
    size = struct.calcsize(layout)
    padding = cloud.point_step - size
    padded = struct.Struct(f"{layout}{max(padding, 0)}x")
    row_size = cloud.width * cloud.point_step
    data = memoryview(bytes(cloud.data))
    for row in range(cloud.height):
        octets = data[row * cloud.row_step :][:row_size]
        if size and padding >= 0 and len(octets) == row_size:
            yield from padded.iter_unpack(octets)
        else:
            yield from _single_points(cloud, layout, ((column, row) for column in range(cloud.width)))


def _in_order(fields: Iterable[PointField], names: Container[str] | None) -> list[PointField]:
    chosen = [field for field in fields if names is None or field.name in names]
    return sorted(chosen, key=lambda field: field.offset)


def _get_struct_fmt(
    is_bigendian: bool, fields: Iterable[PointField], field_names: Container[str] | None = None
) -> str:
    """Return the `struct` format of a point, without padding after the last field.

    Fields of unknown types are skipped, with a warning on standard error.
    """
    layout = ">" if is_bigendian else "<"
    end = 0
    for field in _in_order(fields, field_names):
        layout += "x" * (field.offset - end)
        end = max(end, field.offset)
        if field.datatype not in _DATATYPES:
            print(f"Skipping unknown PointField datatype [{field.datatype}]", file=sys.stderr)
            continue
        code, size = _DATATYPES[field.datatype]
        layout += code * field.count
        end += field.count * size
    return layout
