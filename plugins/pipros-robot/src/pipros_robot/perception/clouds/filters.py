"""The filters of pcl_ros: functions that return a new cloud.

Coordinates are compared in float32, as in PCL; distances and means are computed in float64. Selected points
keep all their bytes. Names and rules are the same as in PCL; `values` maps the names of a nodelet's settings
to their values.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from pipros_robot.perception.clouds.points import (
    POSITION,
    TYPES,
    InvalidCloud,
    column,
    has_field,
    indices_of,
    positions,
    reorganized,
    rows_of,
    with_rows,
)
from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.extras import tree_of

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2

    from pipros_libraries.vision.extras import Array

Values = Mapping[str, Any]

_FARTHEST: Final = 2.0**60
"""Cell indices are clamped to this absolute value."""

_NUMBERS: Final = 2.0**62
"""In voxel grids with at least this many cells, only the occupied cells are numbered."""


def pass_through(cloud: PointCloud2, values: Values) -> PointCloud2:
    """Return the points whose field `filter_field_name` is within the limits, or outside if negated.

    The other points are removed, as are points that are not finite. If `keep_organized` is true, the other
    points are set to NaN instead, and points whose field is NaN are left as they are, as by genuine PCL.

    Raises:
        InvalidCloud: the cloud is invalid, or the field is missing or not of type FLOAT32.
    """
    rows, name = rows_of(cloud), values["filter_field_name"]
    organized = values["keep_organized"]
    if name and not has_field(cloud, name):
        raise InvalidCloud(f"field {name} of a cloud must exist and be of type FLOAT32")
    if not name and organized:
        return reorganized(cloud, rows, is_dense=cloud.is_dense)
    kept = np.ones(len(rows), bool) if organized else np.isfinite(positions(cloud, rows)).all(1)
    if name:
        field = column(cloud, rows, name)
        kept &= _within(field, values) | (organized & np.isnan(field))
    return _without(cloud, rows, ~kept) if organized else with_rows(cloud, rows[kept], is_dense=True)


def _within(field: Array, values: Values) -> Array:
    """Return a mask of the values that are finite and within the limits, or outside if negated."""
    low, high = values["filter_limit_min"], values["filter_limit_max"]
    with np.errstate(invalid="ignore"):
        if values["filter_limit_negative"]:
            chosen: Array = np.isfinite(field) & ((field <= low) | (field >= high))
        else:
            chosen = np.isfinite(field) & (field >= low) & (field <= high)
    return chosen


def _without(cloud: PointCloud2, rows: Array, removed: Array) -> PointCloud2:
    """Return a cloud of the same shape in which the positions of the removed points are NaN."""
    changed = rows.copy()
    positions(cloud, changed)  # the fields must be of type FLOAT32
    for name in POSITION:
        column(cloud, changed, name)[removed] = np.nan
    return reorganized(cloud, changed, is_dense=False)


def crop_box(cloud: PointCloud2, values: Values, indices: Array | None = None) -> PointCloud2:
    """Return the points inside a box (including its faces), or outside if negated. NaN counts as inside.

    If `keep_organized` is true, the other points are set to NaN instead of being removed.

    Args:
        indices: indices of the points to filter; defaults to all points. Points without an index are removed,
            or left unchanged if `keep_organized` is true.

    Raises:
        InvalidCloud: the cloud is invalid, or an index is out of range.
    """
    rows = rows_of(cloud)
    chosen = indices_of(indices, len(rows))
    points = positions(cloud, rows)[chosen]
    low, high = (
        np.array([values[f"{end}_{axis}"] for axis in POSITION], np.float32) for end in ("min", "max")
    )
    with np.errstate(invalid="ignore"):
        outside = ((points < low) | (points > high)).any(1)
    removed = outside != values["negative"]
    if values["keep_organized"]:
        is_removed = np.zeros(len(rows), bool)
        is_removed[chosen] = removed
        return _without(cloud, rows, is_removed)
    return with_rows(cloud, rows[chosen[~removed]], is_dense=cloud.is_dense)


def extract_indices(cloud: PointCloud2, indices: Array | None, values: Values) -> PointCloud2:
    """Return the points with these indices, in the order of the indices, or all other points if negated.

    As in PCL, the cloud is returned unchanged if there are as many indices as points, unless negated.

    Raises:
        InvalidCloud: the cloud is invalid, or an index is out of range.
    """
    rows = rows_of(cloud)
    chosen = indices_of(indices, len(rows))
    is_all, negative = len(chosen) == len(rows), values["negative"]
    if (is_all and not negative) or (not len(chosen) and negative):
        return reorganized(cloud, rows, is_dense=cloud.is_dense)
    if negative:
        kept = np.ones(len(rows), bool)
        kept[chosen] = False
        found = rows[kept]
    else:
        found = rows[chosen]
    return with_rows(cloud, found, is_dense=False) if len(found) else emptied(cloud)


def emptied(cloud: PointCloud2, *, keeps_sizes: bool = False) -> PointCloud2:
    """Return an empty cloud with the header and fields of `cloud`, as in PCL.

    `point_step` and `row_step` are 0 unless `keeps_sizes` is true.
    """
    made = type(cloud)(header=cloud.header, fields=cloud.fields, is_bigendian=cloud.is_bigendian)
    if keeps_sizes:
        made.point_step, made.row_step, made.is_dense = cloud.point_step, cloud.row_step, True
    return made


def statistical_outlier_removal(
    cloud: PointCloud2, values: Values, indices: Array | None = None
) -> PointCloud2:
    """Return the points whose mean distance to their `mean_k` - 1 nearest neighbours is not an outlier.

    A distance is an outlier if it exceeds the mean of the distances by more than `stddev` times their
    standard deviation. If `negative` is true, return the other points. NaN points are not outliers.

    Args:
        indices: indices of the points to filter; defaults to all points. Points without an index are removed,
            but count as neighbours.

    Raises:
        InvalidCloud: the cloud is invalid, `stddev` is 0, or an index is out of range.
    """
    if values["stddev"] == 0.0:
        raise InvalidCloud("stddev must not be 0")
    rows = rows_of(cloud)
    points = positions(cloud, rows)
    chosen = indices_of(indices, len(rows))
    finite = np.isfinite(points).all(1)
    is_valid, near = finite[chosen], min(values["mean_k"], int(finite.sum()))
    distances = np.zeros(len(chosen))
    if near > 1:
        tree = tree_of(points[finite], "pcl/StatisticalOutlierRemoval")
        found, _ = tree.query(points[chosen[is_valid]], k=near)
        distances[is_valid] = found[:, 1:].sum(1) / (values["mean_k"] - 1)
    valid = distances[is_valid]
    deviation = valid.std(ddof=1) if len(valid) > 1 else 0.0
    is_outlier = distances > (valid.mean() if len(valid) else 0.0) + values["stddev"] * deviation
    return with_rows(cloud, rows[chosen[is_outlier == values["negative"]]], is_dense=cloud.is_dense)


def voxel_grid(cloud: PointCloud2, values: Values) -> PointCloud2:
    """Return one point for each grid cell with at least `min_points_per_voxel` points.

    Points that are not finite or outside the limits are ignored. Each field is the mean of the cell's points;
    `rgb` and `rgba` are averaged byte by byte. The result is sorted by cell.

    Raises:
        InvalidCloud: the cloud is invalid, a leaf size is not greater than 0, or the field
            `filter_field_name` is missing or not of type FLOAT32.
    """
    rows, name = rows_of(cloud), values["filter_field_name"]
    leaf = leaf_sizes(values)
    points = positions(cloud, rows)
    kept = np.isfinite(points).all(1)
    if name:
        if not has_field(cloud, name):
            raise InvalidCloud(f"field {name} of a cloud must exist and be of type FLOAT32")
        kept &= _within(column(cloud, rows, name), values)
    if not kept.all():
        rows, points = rows[kept], points[kept]
    if not len(rows):
        return with_rows(cloud, rows, is_dense=True)
    keys = _cell_numbers(points, leaf)
    order = _ascending(keys)
    keys = keys[order]
    group = np.empty(len(keys), np.int64)
    group[order] = np.cumsum(np.concatenate([[False], keys[1:] != keys[:-1]]))
    counts = np.bincount(group)
    means = _means(cloud, rows, group, counts)
    enough = counts >= values["min_points_per_voxel"]
    return with_rows(cloud, means if enough.all() else means[enough], is_dense=True)


def _cell_numbers(points: Array, leaf: Array) -> Array:
    """Return the cell number of each point; x varies fastest."""
    cells = []
    for axis, size in enumerate(leaf):
        with np.errstate(over="ignore"):
            scaled = np.floor(points[:, axis] * (np.float32(1.0) / size)).astype(np.float64)
        cells.append(np.clip(scaled, -_FARTHEST, _FARTHEST, out=scaled).astype(np.int64))
        cells[-1] -= cells[-1].min()
    x, y, z = cells
    width, height, depth = (int(each.max()) + 1 for each in cells)
    if float(width) * height * depth >= _NUMBERS:
        inverse: Array = np.unique(np.stack([z, y, x], 1), axis=0, return_inverse=True)[1]
        return inverse.reshape(-1)
    numbers: Array = x + width * (y + height * z)
    return numbers


def _ascending(keys: Array) -> Array:
    """Return the order that sorts integers >= 0.

    Sorts by 16 bits at a time, because numpy sorts such numbers, and no larger ones, by radix: for numbers of
    32 bits in a sixth of the time of `argsort`.
    """
    order = np.arange(len(keys))
    for shift in range(0, int(keys.max()).bit_length(), 16):
        order = order[np.argsort((keys[order] >> shift).astype(np.uint16), kind="stable")]
    return order


def leaf_sizes(values: Values) -> Array:
    """Return a cell's size along each axis in float32. `leaf_size` applies to axes with a negative size.

    Raises:
        InvalidCloud: a size is not greater than 0.
    """
    general = values["leaf_size"]
    own = [values.get(f"leaf_size_{axis}", -1.0) for axis in POSITION]
    leaf = np.array([each if each >= 0 else general for each in own], np.float32)
    if not (leaf > 0).all():
        raise InvalidCloud(f"leaf sizes must be greater than 0, got {leaf.min():g}")
    return leaf


def _means(cloud: PointCloud2, rows: Array, group: Array, counts: Array) -> Array:
    """Return one row for each group of rows; its fields are the means of the group's fields.

    Args:
        group: the group of each row.
        counts: the number of rows in each group.
    """
    means = np.zeros((len(counts), rows.shape[1]), np.uint8)
    for field in cloud.fields:
        if field.datatype not in TYPES:
            continue
        if field.name in ("rgb", "rgba"):
            for at in range(field.offset, min(field.offset + 4, rows.shape[1])):
                means[:, at] = np.bincount(group, rows[:, at]) / counts
            continue
        target, source = column(cloud, means, field.name), column(cloud, rows, field.name)
        with np.errstate(all="ignore"):
            sums = np.bincount(group, source) / counts
            target[:] = sums if target.dtype.kind == "f" else np.rint(sums).astype(target.dtype)
    return means
