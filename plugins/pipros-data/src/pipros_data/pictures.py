"""Columns whose cells are decoded when they are accessed: images and point clouds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pipros.msg.bulk.columns import Column, selects_cells
from pipros_libraries.pictures.compressed import pixels_of
from pipros_libraries.pictures.encodings import encoding
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.yuv import LAYOUTS, plane_rows

_POINT_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""Types by `PointField.datatype`."""


class LazyColumn:
    """A column of decoded images or clouds. `column[i]` decodes one cell; the result is not cached.

    Slices, lists and masks give a column, whose cells are not decoded yet.

    Accessing a malformed cell raises `PictureError`.
    """

    def __init__(self, columns: Mapping[str, Column], decode: Callable[[Mapping[str, Any]], Any]) -> None:
        self._columns = columns
        self._decode = decode

    def __len__(self) -> int:
        return len(self._columns["data"])

    def __getitem__(self, number: Any) -> Any:
        if selects_cells(number):
            return LazyColumn({name: each[number] for name, each in self._columns.items()}, self._decode)
        row = range(len(self))[number]  # raises IndexError
        return self._decode({name: column[row] for name, column in self._columns.items()})

    def __repr__(self) -> str:
        return f"<LazyColumn of {len(self)} cells>"


def image_array(row: Mapping[str, Any]) -> Any:
    """Return the pixels of a `sensor_msgs/Image`, indexed by row, column and, if it has several, channel.

    Raises:
        PictureError: the encoding is unknown, or the rows or the data are too short.
    """
    name = row["encoding"]
    try:
        found = encoding(name if name not in LAYOUTS else "8UC2" if len(LAYOUTS[name]) == 4 else "8UC1")
    except RuntimeError as error:
        raise PictureError(str(error)) from None
    dtype = np.dtype(found.dtype).newbyteorder(">" if row["is_bigendian"] else "<")
    height, width, step, data = int(row["height"]), int(row["width"]), int(row["step"]), row["data"]
    if name in LAYOUTS:
        height = plane_rows(name, height, len(data), step)
    line = width * found.channels * dtype.itemsize
    if step < line or len(data) < step * height:
        raise PictureError(
            f"{width} x {height} pixels of {name} need rows of at least {line} bytes, and "
            f"{max(line, step) * height} bytes in total, got rows of {step}, and {len(data)} in total"
        )
    shape = (height, width) if found.channels == 1 else (height, width, found.channels)
    strides = (step, found.channels * dtype.itemsize, dtype.itemsize)
    return np.ndarray(shape, dtype, data, 0, strides[: len(shape)])


def picture_array(row: Mapping[str, Any]) -> Any:
    """Return the pixels of a `sensor_msgs/CompressedImage`; see `pixels_of`.

    Raises:
        PictureError: the data are not a valid picture.
        MissingExtra: neither OpenCV nor Pillow is installed.
    """
    from pipros_libraries.pictures.codecs import codec

    return pixels_of(row["format"], row["data"], codec())


def cloud_array(row: Mapping[str, Any]) -> Any:
    """Return the points of a `sensor_msgs/PointCloud2` as a structured array of shape (height, width).

    Raises:
        PictureError: a field has an unknown type, occurs twice or does not fit into a point, or points are
            missing.
    """
    order = ">" if row["is_bigendian"] else "<"
    names, formats, offsets = [], [], []
    size = int(row["point_step"])
    for field in row["fields"]:
        if int(field["datatype"]) not in _POINT_TYPES:
            raise PictureError(f"datatype must be from 1 to 8, got {field['datatype']} for {field['name']!r}")
        one = np.dtype(order + _POINT_TYPES[int(field["datatype"])])
        count, offset = int(field["count"]), int(field["offset"])
        if offset + max(count, 1) * one.itemsize > size or field["name"] in names:
            raise PictureError(
                f"the field {field['name']!r} must be unique and fit into a point of {size} bytes"
            )
        names.append(field["name"])
        formats.append(one if count <= 1 else np.dtype((one, (count,))))
        offsets.append(offset)
    height, width, step, data = int(row["height"]), int(row["width"]), int(row["row_step"]), row["data"]
    if step < width * size or len(data) < step * height:
        raise PictureError(
            f"{width} x {height} points of {size} bytes need rows of at least {width * size} bytes, and "
            f"{max(step, width * size) * height} bytes in total, got rows of {step}, and {len(data)} in total"
        )
    dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})
    return np.ndarray((height, width), dtype, data, 0, (step, size))


LAZY_COLUMNS = {
    "sensor_msgs/Image": ("_image", image_array),
    "sensor_msgs/CompressedImage": ("_image", picture_array),
    "sensor_msgs/PointCloud2": ("_points", cloud_array),
}
"""For each type, the name of its additional column, and the function that decodes a cell."""
