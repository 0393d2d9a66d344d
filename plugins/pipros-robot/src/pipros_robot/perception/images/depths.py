"""Depth images: unit conversion, conversion to points, and registration.

Depths are measured along the optical axis.
`16UC1` images contain millimetres, and 0 for unknown depths; `32FC1` images contain metres, and NaN for
unknown depths.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from pipros.basics.printable import printable
from pipros_libraries.vision.extras import numpy as np
from pipros_robot.perception.images.arrays import BadImage
from pipros_robot.perception.images.pinhole import Pinhole

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array

METRES: Final = "32FC1"
MILLIMETRES: Final = "16UC1"
ENCODINGS: Final = (MILLIMETRES, METRES)

_UNIT = {MILLIMETRES: np.float32(0.001), METRES: np.float32(1)}
_WIDEST_FILL = 16
"""Maximum number of pixels that one depth fills in each direction, in addition to the first."""


def checked(encoding_name: str) -> str:
    """Check the encoding of a depth image, and return it. Return 16UC1 for mono16.

    Raises:
        BadImage: the encoding is not 16UC1, mono16 or 32FC1.
    """
    name = MILLIMETRES if encoding_name == "mono16" else encoding_name
    if name not in ENCODINGS:
        raise BadImage(f"a depth image must be 16UC1 or 32FC1, got [{printable(encoding_name)}]")
    return name


def converted_metric(image: Array, encoding_name: str) -> tuple[Array, str]:
    """Convert millimetres to metres, or metres to millimetres. Return the image and its encoding."""
    if checked(encoding_name) == MILLIMETRES:
        return np.where(image == 0, np.float32(np.nan), image * _UNIT[MILLIMETRES]), METRES
    with np.errstate(invalid="ignore"):
        scaled = image * np.float32(1000)
        return np.where(np.isfinite(scaled), scaled, 0).astype(np.uint16), MILLIMETRES


def _with_nan(image: Array, encoding_name: str) -> Array:
    """Return the depths as float32 in their original unit, with NaN for unknown depths."""
    if encoding_name == MILLIMETRES:
        depths = image.astype(np.float32)
        depths[image == 0] = np.nan
        return depths
    return np.where(np.isfinite(image), image, np.float32(np.nan))


def set_points(points: Array, image: Array, encoding_name: str, camera: Pinhole) -> None:
    """Set x, y and z of each point in metres; NaN if the depth is unknown.

    Products are computed in single precision and in the same order as in depth_image_proc.
    """
    name = checked(encoding_name)
    depths, unit = _with_nan(image, name), _UNIT[name]
    height, width = depths.shape
    u = np.arange(width, dtype=np.float32) - np.float32(camera.cx)
    v = np.arange(height, dtype=np.float32) - np.float32(camera.cy)
    product = np.multiply(depths, u)
    np.multiply(product, np.float32(float(unit) / camera.fx), out=points[:, :, 0])
    np.multiply(depths, v[:, None], out=product)
    np.multiply(product, np.float32(float(unit) / camera.fy), out=points[:, :, 1])
    np.multiply(depths, unit, out=points[:, :, 2])


def registered(
    image: Array,
    encoding_name: str,
    camera: Pinhole,
    target: Pinhole,
    size: tuple[int, int],
    transform: Array,
    *,
    fills_holes: bool = False,
) -> Array:
    """Return a depth image as seen by another camera, in the same encoding.

    Args:
        camera, target: the cameras of the image and of the result.
        size: height and width of the result.
        transform: 4x4 matrix that transforms points from the frame of `camera` to that of `target`.
        fills_holes: whether each depth fills the pixels of the result that its source pixel covers.
    """
    name = checked(encoding_name)
    depths = (_with_nan(image, name) * _UNIT[name]).astype(np.float64)  # single precision, as in Noetic
    v, u = np.nonzero(np.isfinite(depths))
    z = depths[v, u]
    if not fills_holes:
        rows, columns, seen = _projected(u, v, z, camera, target, transform)
        return _nearest(rows, columns, seen, size, name)
    low_v, low_u, low_z = _projected(u - 0.5, v - 0.5, z, camera, target, transform)
    high_v, high_u, high_z = _projected(u + 0.5, v + 0.5, z, camera, target, transform)
    seen = (low_z + high_z) / 2
    whole = (low_v >= 0) & (low_u >= 0) & (high_v < size[0]) & (high_u < size[1])
    low_v, low_u, high_v, high_u, seen = (each[whole] for each in (low_v, low_u, high_v, high_u, seen))
    found: list[tuple[Array, Array, Array]] = []
    for step_v in range(min(int(np.max(high_v - low_v, initial=0)), _WIDEST_FILL) + 1):
        for step_u in range(min(int(np.max(high_u - low_u, initial=0)), _WIDEST_FILL) + 1):
            covers = (low_v + step_v <= high_v) & (low_u + step_u <= high_u)
            found.append((low_v[covers] + step_v, low_u[covers] + step_u, seen[covers]))
    rows, columns, seen = (np.concatenate(each) for each in zip(*found, strict=True))
    return _nearest(rows, columns, seen, size, name)


def _projected(
    u: Array, v: Array, z: Array, camera: Pinhole, target: Pinhole, transform: Array
) -> tuple[Array, Array, Array]:
    """Project pixels into another camera. Return their rows, columns and depths."""
    with np.errstate(all="ignore"):
        points = np.stack(
            [
                ((u - camera.cx) * z - camera.tx) / camera.fx,
                ((v - camera.cy) * z - camera.ty) / camera.fy,
                z,
                np.ones_like(z),
            ]
        )
        x, y, seen = (np.asarray(transform) @ points)[:3]
        columns = (target.fx * x + target.tx) / seen + target.cx + 0.5
        rows = (target.fy * y + target.ty) / seen + target.cy + 0.5
    limit = 2**30
    columns, rows = (np.nan_to_num(np.clip(each, -limit, limit)).astype(np.int64) for each in (columns, rows))
    return rows, columns, seen


def _nearest(rows: Array, columns: Array, depths: Array, size: tuple[int, int], name: str) -> Array:
    """Return a depth image with the smallest depth for each pixel."""
    height, width = size
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width) & (depths > 0)
    depths = depths[inside]
    places = rows[inside] * width + columns[inside]
    order = np.argsort(-depths, kind="stable")  # write from far to near, so that the nearest remain
    if name == MILLIMETRES:
        result = np.zeros(height * width, np.uint16)
        result[places[order]] = np.clip(
            depths[order].astype(np.float32) * np.float32(1000) + np.float32(0.5), 0, 65535
        ).astype(np.uint16)
    else:
        result = np.full(height * width, np.nan, np.float32)
        result[places[order]] = depths[order]
    return result.reshape(height, width)
