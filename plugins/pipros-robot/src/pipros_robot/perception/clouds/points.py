"""The fields of a `sensor_msgs/PointCloud2` as arrays, and clouds made from arrays.

A cloud's points are rows of `point_step` bytes. Functions that select or transform points leave all other
bytes unchanged.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros_libraries.transforms.pose import Pose, rotation_matrix
from pipros_robot.perception.extras import numpy as np

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2, PointField
    from std_msgs.msg import Header

    from pipros_libraries.vision.extras import Array

FLOAT32: Final = 7
TYPES: Final = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""numpy's types by `PointField.datatype`."""

CODES: Final = {name: code for code, name in TYPES.items()}
POSITION: Final = ("x", "y", "z")


class InvalidCloud(PiprosError, ValueError):
    """A cloud's fields do not match its data, a field is missing, or a value is invalid."""


def rows_of(cloud: PointCloud2) -> Array:
    """Return the bytes of the points, an array of shape (points, point_step), without copying.

    Raises:
        InvalidCloud: the length of the data is not width * height * point_step, or point_step is 0 although
            the cloud has points.
    """
    count, step = cloud.width * cloud.height, cloud.point_step
    data = np.frombuffer(cloud.data, np.uint8)
    if len(data) != count * step or (count and not step):
        raise InvalidCloud(
            f"data of a cloud must have width * height * point_step = {cloud.width} * {cloud.height} * "
            f"{step} bytes, got {len(data)}"
            if len(data) != count * step
            else "point_step of a cloud must be > 0, got 0"
        )
    return data.reshape(count, step)


def indices_of(given: Array | None, count: int) -> Array:
    """Return indices as an array; if None is given, the indices of all `count` points.

    Raises:
        InvalidCloud: an index is out of range.
    """
    if given is None:
        return np.arange(count)
    chosen = np.asarray(given, np.int64)
    if len(chosen) and not 0 <= chosen.min() <= chosen.max() < count:
        raise InvalidCloud(f"indices must be >= 0 and < {count}, got {chosen.min()} to {chosen.max()}")
    return chosen


def column(cloud: PointCloud2, rows: Array, name: str) -> Array:
    """Return the values of a field as an array of shape (points,). The array is writable if `rows` is.

    Raises:
        InvalidCloud: the field is missing, has an unknown type, or lies outside the point.
    """
    field = next((each for each in cloud.fields if each.name == name), None)
    if field is None:
        raise InvalidCloud(f"a cloud must have the field {name}, got {[each.name for each in cloud.fields]}")
    kind = np.dtype(TYPES.get(field.datatype, "V0")).newbyteorder(">" if cloud.is_bigendian else "<")
    if not 0 < kind.itemsize <= rows.shape[1] - field.offset:
        raise InvalidCloud(
            f"field {name} must have a known type and lie within the point, got type {field.datatype} at "
            f"offset {field.offset} of {rows.shape[1]} bytes"
        )
    return (
        rows[:, field.offset : field.offset + kind.itemsize].view(kind)[:, 0]
        if len(rows)
        else np.empty(0, kind)
    )


def has_field(cloud: PointCloud2, name: str, datatype: int = FLOAT32) -> bool:
    """Return whether the cloud has a field with this name and type."""
    return any(each.name == name and each.datatype == datatype for each in cloud.fields)


def positions(cloud: PointCloud2, rows: Array) -> Array:
    """Return x, y and z as a new float32 array of shape (points, 3).

    Raises:
        InvalidCloud: a field is missing, is not of type FLOAT32, or lies outside the point.
    """
    for name in POSITION:
        if not has_field(cloud, name):
            raise InvalidCloud(f"field {name} of a cloud must exist and be of type FLOAT32")
    found = np.empty((3, len(rows)), np.float32).T  # columns are read more often than points
    for axis, name in enumerate(POSITION):
        found[:, axis] = column(cloud, rows, name)
    return found


def with_rows(cloud: PointCloud2, rows: Array, *, is_dense: bool) -> PointCloud2:
    """Return an unorganized cloud (height 1) with the fields and header of `cloud`, and the given points."""
    return type(cloud)(
        header=cloud.header,
        height=1,
        width=len(rows),
        fields=cloud.fields,
        is_bigendian=cloud.is_bigendian,
        point_step=rows.shape[1],
        row_step=rows.size,
        data=np.ascontiguousarray(rows).reshape(-1),
        is_dense=is_dense,
    )


def reorganized(cloud: PointCloud2, rows: Array, *, is_dense: bool) -> PointCloud2:
    """Return a copy of `cloud` with other points. `rows` must contain as many points as `cloud`."""
    made = with_rows(cloud, rows, is_dense=is_dense)
    made.height, made.width = cloud.height, cloud.width
    made.row_step = cloud.width * cloud.point_step
    return made


def cloud_of(header: Header, columns: Mapping[str, Array], point_step: int = 0) -> PointCloud2:
    """Return an unorganized cloud (of height 1) with the given values.

    Args:
        columns: arrays of equal length, by field name.
        point_step: size of a point in bytes, if larger than the total size of its fields.
    """
    field_class: type[PointField] = load_message_class("sensor_msgs/PointField")
    kinds = {name: np.dtype(values.dtype).newbyteorder("<") for name, values in columns.items()}
    sizes = [kind.itemsize for kind in kinds.values()]
    offsets = [sum(sizes[:index]) for index in range(len(sizes))]
    count = len(next(iter(columns.values())))
    layout: Any = {"names": list(kinds), "formats": list(kinds.values()), "offsets": offsets}
    layout["itemsize"] = max(point_step, sum(sizes))
    points = np.zeros(count, np.dtype(layout))
    for name, values in columns.items():
        points[name] = values
    fields = [
        field_class(name, offset, CODES[kind.str[1:]], 1)
        for (name, kind), offset in zip(kinds.items(), offsets, strict=True)
    ]
    cloud_class: type[PointCloud2] = load_message_class("sensor_msgs/PointCloud2")
    return cloud_class(
        header=header,
        height=1,
        width=count,
        fields=fields,
        is_bigendian=False,
        point_step=points.itemsize,
        row_step=points.nbytes,
        data=points.view(np.uint8).reshape(-1) if count else b"",
        is_dense=False,
    )


def matrix_of(pose: Pose, kind: type[np.float32 | np.float64] = np.float32) -> Array:
    """Return the first three rows of a pose's matrix, computed in the type `kind` with Eigen's formula."""
    px, py, pz, *quaternion = pose
    x, y, z, w = (kind(value) for value in quaternion)
    one, two = kind(1), kind(2)
    tx, ty, tz = two * x, two * y, two * z
    twx, twy, twz, txx, txy, txz = tx * w, ty * w, tz * w, tx * x, ty * x, tz * x
    tyy, tyz, tzz = ty * y, tz * y, tz * z
    return np.array(
        [
            [one - (tyy + tzz), txy - twz, txz + twy, px],
            [txy + twz, one - (txx + tzz), tyz - twx, py],
            [txz - twy, tyz + twx, one - (txx + tyy), pz],
        ],
        kind,
    )


def exact_matrix_of(pose: Pose) -> Array:
    """Return the first three rows of a pose's matrix in float32, computed in float64 with tf's formula."""
    rotation = np.array(rotation_matrix(pose)).reshape(3, 3)
    exact: Array = np.concatenate([rotation, np.array(pose[:3])[:, np.newaxis]], 1)
    with np.errstate(over="ignore"):  # a transform may have any finite number
        return exact.astype(np.float32)


def moved(points: Array, matrix: Array) -> Array:
    """Transform points of shape (n, 3). The result has the matrix's type; sums are in Eigen's order."""
    x, y, z = (points[:, axis, np.newaxis].astype(matrix.dtype) for axis in range(3))
    with np.errstate(all="ignore"):
        found: Array = x * matrix[:, 0] + y * matrix[:, 1] + z * matrix[:, 2] + matrix[:, 3]
    return found
