"""Convert the middle rows of a depth image to a laser scan, as in depthimage_to_laserscan 1.0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import PiprosError
from pipros_libraries.vision.distortion import undistorted
from pipros_robot.perception.extras import numpy as np

if TYPE_CHECKING:
    from sensor_msgs.msg import CameraInfo, Image

    from pipros_libraries.vision.extras import Array

_METRES: Final = {"16UC1": np.float32(0.001), "32FC1": np.float32(1.0)}


class InvalidDepthImage(PiprosError, ValueError):
    """A depth image or its calibration cannot be converted to a scan. The text says why."""


@dataclass(frozen=True, slots=True)
class View:
    """Geometry of a rectified image.

    Attributes:
        focal_length, center_x, center_y: focal length and principal point in pixels.
        angle_min, angle_max: angles of the image's right and left edge.
    """

    focal_length: float
    center_x: float
    center_y: float
    angle_min: float
    angle_max: float

    def increment(self, width: int) -> Any:
        """Return the angle between adjacent beams for an image of this width, as float32."""
        with np.errstate(all="ignore"):
            return (np.float32(self.angle_max) - np.float32(self.angle_min)) / np.float32(width - 1)


def view_of(info: CameraInfo, width: int) -> View:
    """Compute the geometry of the rectified image from a `sensor_msgs/CameraInfo`.

    Raises:
        InvalidDepthImage: the camera is not calibrated, or has an invalid number of distortion coefficients.
    """
    camera, projection = np.array(info.K).reshape(3, 3), np.array(info.P).reshape(3, 4)
    for matrix in (camera, projection):
        matrix[:2, 2] -= info.roi.x_offset, info.roi.y_offset
        matrix[:2] /= np.array([[max(info.binning_x, 1)], [max(info.binning_y, 1)]])
    fx, fy, cx, cy = projection[0, 0], projection[1, 1], projection[0, 2], projection[1, 2]
    if not fx > 0 or not fy > 0 or not camera[0, 0] > 0:
        raise InvalidDepthImage("the camera is not calibrated: its focal lengths must be greater than 0")
    coefficients = info.D if any(info.D) else None

    def ray(u: float) -> Array:
        pixel = np.array([u, cy])
        if coefficients is not None:
            raw = pixel.astype(np.float32).astype(np.float64)
            rotation = np.array(info.R).reshape(3, 3)
            try:
                pixel = undistorted(list(raw), camera, coefficients, rotation, projection)
            except ValueError as error:
                raise InvalidDepthImage(str(error)) from error
            pixel = pixel.astype(np.float32).astype(np.float64)
        return np.array(
            [(pixel[0] - cx - projection[0, 3]) / fx, (pixel[1] - cy - projection[1, 3]) / fy, 1.0]
        )

    left, center, right = ray(0), ray(cx), ray(width - 1)
    return View(fx, cx, cy, -_angle(center, right), _angle(left, center))


def _angle(one: Array, other: Array) -> float:
    return float(np.arccos(one @ other / (np.sqrt(one @ one) * np.sqrt(other @ other))))


@dataclass(frozen=True, slots=True)
class DepthToScan:
    """Converts depth images to ranges.

    Attributes:
        scan_height: number of rows to use, around the principal point.
        range_min, range_max: ranges outside these limits are ignored.
    """

    scan_height: int = 1
    range_min: float = 0.45
    range_max: float = 10.0

    def ranges(self, image: Image, view: View) -> Array:
        """Return the smallest distance in each beam as float32; NaN or an infinity if there is none.

        Args:
            image: a `sensor_msgs/Image` with depths.

        Raises:
            InvalidDepthImage: the encoding or size is invalid, or the image has too few rows.
        """
        half = self.scan_height // 2
        if not half <= view.center_y <= image.height - half:
            raise InvalidDepthImage(
                f"scan_height ({self.scan_height} pixels) is too large for the image height ({image.height})"
            )
        metres = _METRES.get(image.encoding)
        if metres is None:
            raise InvalidDepthImage(f"encoding of a depth image must be 16UC1 or 32FC1, got {image.encoding}")
        first = int(np.float32(view.center_y) - np.float32(half))
        depths = _pixels(image)[first : first + self.scan_height]
        offsets = np.arange(image.width, dtype=np.float32) - np.float32(view.center_x)
        constant = np.float32(np.float64(metres) / view.focal_length)
        with np.errstate(all="ignore"):
            angles = -np.arctan2(offsets.astype(np.float64) * constant, np.float64(metres))
            beams = (angles - np.float32(view.angle_min)) / view.increment(image.width)
            values = depths.astype(np.float32)
            valid = depths != 0 if image.encoding == "16UC1" else np.isfinite(values)
            x = offsets * values * constant
            distances = np.where(
                valid, np.hypot(x.astype(np.float64), (values * metres).astype(np.float64)), values
            ).astype(np.float32)
        beams = np.where(np.isfinite(beams), np.clip(beams, -1, image.width), image.width).astype(np.int64)
        return self._nearest(distances, np.broadcast_to(beams, distances.shape), image.width)

    def _nearest(self, distances: Array, beams: Array, count: int) -> Array:
        """Return the smallest distance within the limits for each beam, otherwise an infinity or NaN."""
        ranges = np.full(count, np.nan, np.float32)
        inside = (beams >= 0) & (beams < count)
        infinite = inside & np.isinf(distances)
        ranges[beams[infinite]] = distances[infinite]
        kept = inside & (distances >= np.float32(self.range_min)) & (distances <= np.float32(self.range_max))
        kept &= np.isfinite(distances)
        nearest = np.full(count, np.inf, np.float32)
        np.minimum.at(nearest, beams[kept], distances[kept])
        return np.where(np.isfinite(nearest), nearest, ranges)


def _pixels(image: Image) -> Array:
    """Return the depths in an image as an array of shape (height, width)."""
    kind = np.dtype("u2" if image.encoding == "16UC1" else "f4")
    kind = kind.newbyteorder(">" if image.is_bigendian else "<")
    row = image.width * kind.itemsize
    if image.step < row or len(image.data) < image.step * image.height or not image.height:
        raise InvalidDepthImage(
            f"an image of {image.width} x {image.height} pixels must have {max(image.height, 1)} rows of "
            f"at least {row} bytes, got {len(image.data)} bytes in rows of {image.step}"
        )
    rows = np.frombuffer(image.data, np.uint8)[: image.step * image.height].reshape(image.height, image.step)
    return rows[:, :row].copy().view(kind)
