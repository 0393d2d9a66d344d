"""Pinhole cameras described by `sensor_msgs/CameraInfo`: rectification, binning and regions of interest.

Pixels are (u, v): column, row. In camera frames, x points right, y down and z forward. Lengths are in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros_libraries.vision.extras import numpy as np
from pipros_libraries.vision.opencv import opencv

if TYPE_CHECKING:
    from sensor_msgs.msg import CameraInfo

    from pipros_libraries.vision.extras import Array

MOST_PIXELS: Final = 2**26
"""Maximum number of pixels in an image. Without this limit, an invalid calibration could exhaust memory."""

_MODELS = ("plumb_bob", "rational_polynomial", "equidistant")


class Uncalibrated(PiprosError, ValueError):
    """A camera is not calibrated, or its calibration is invalid or unsupported."""


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A rectified camera: (x, y, z) appears at the pixel ((fx x + tx) / z + cx, (fy y + ty) / z + cy).

    All values refer to the published image, that is, after binning and cropping.

    Attributes:
        tx, ty: the fourth column of the projection matrix: minus the focal length times the baseline.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    tx: float = 0.0
    ty: float = 0.0

    @classmethod
    def of(cls, info: CameraInfo) -> Pinhole:
        """Return the camera that a `sensor_msgs/CameraInfo` describes.

        Raises:
            Uncalibrated: a focal length is 0.
        """
        p, (bin_x, bin_y) = info.P, binning(info)
        if not p[0] or not p[5]:
            raise Uncalibrated("the camera is not calibrated: P has no focal length")
        return cls(
            p[0] / bin_x,
            p[5] / bin_y,
            (p[2] - info.roi.x_offset) / bin_x,
            (p[6] - info.roi.y_offset) / bin_y,
            p[3] / bin_x,
            p[7] / bin_y,
        )


def binning(info: CameraInfo) -> tuple[int, int]:
    """Return the binning in x and y, at least 1."""
    return max(info.binning_x, 1), max(info.binning_y, 1)


def check_size(height: int, width: int) -> None:
    """Check the size of an image.

    Raises:
        Uncalibrated: the image has no pixels, or more than `MOST_PIXELS`.
    """
    if not 0 < height * width <= MOST_PIXELS:
        raise Uncalibrated(f"a calibrated image must have 1 to {MOST_PIXELS} pixels, got {width} x {height}")


def key_of(info: CameraInfo) -> tuple[Any, ...]:
    """Return all fields of the message except its header, to detect a changed calibration."""
    roi = info.roi
    return (
        (info.width, info.height, info.distortion_model, *binning(info)),
        (tuple(info.D), tuple(info.K), tuple(info.R), tuple(info.P)),
        (roi.x_offset, roi.y_offset, roi.width, roi.height),
    )


class Rectifier:
    """Rectifies images with one calibration. The maps are computed for the first image."""

    def __init__(self, info: CameraInfo) -> None:
        """Read the calibration.

        Raises:
            Uncalibrated: K has no focal length, the image size is invalid, or the distortion model is
                unknown.
        """
        if not info.K[0]:
            raise Uncalibrated("the camera is not calibrated: K has no focal length")
        check_size(info.height, info.width)
        if any(info.D) and info.distortion_model not in _MODELS:
            raise Uncalibrated(
                f"distortion model must be {', '.join(_MODELS[:-1])} or {_MODELS[-1]}, "
                f"got [{printable(info.distortion_model)}]"
            )
        self.key = key_of(info)
        self._info = info
        self._maps: tuple[Array, Array] | None = None

    @property
    def is_needed(self) -> bool:
        """Whether the lens distorts images. As in image_proc, a rotation alone is ignored."""
        return any(self._info.D)

    def rectified(self, image: Array, interpolation: int) -> Array:
        """Return the rectified image. Pixels without a source are 0, or NaN in float images.

        Raises:
            Uncalibrated: the binning leaves no pixels, or the region of interest lies outside the image.
            cv2.error: OpenCV cannot remap the image.
        """
        cv2 = opencv("rectifying images")
        if self._maps is None:
            self._maps = self._new_maps(cv2)
        border = np.nan if image.dtype.kind == "f" else 0
        found: Array = cv2.remap(
            image, *self._maps, interpolation, borderMode=cv2.BORDER_CONSTANT, borderValue=[border] * 4
        )
        return found

    def _new_maps(self, cv2: Any) -> tuple[Array, Array]:
        info = self._info
        bin_x, bin_y = binning(info)
        scale = np.array([[1 / bin_x, 1, 1 / bin_x], [1, 1 / bin_y, 1 / bin_y], [1, 1, 1]])
        k = np.array(info.K, float).reshape(3, 3) * scale
        p = np.array(info.P, float).reshape(3, 4)[:, :3] * scale
        r, d = np.array(info.R, float).reshape(3, 3), np.array(info.D, float)
        size = info.width // bin_x, info.height // bin_y
        check_size(*size)
        if info.distortion_model == "equidistant":
            maps = cv2.fisheye.initUndistortRectifyMap(k, d[:4], r, p, size, cv2.CV_16SC2)
        else:
            maps = cv2.initUndistortRectifyMap(k, d, r, p, size, cv2.CV_16SC2)
        roi = info.roi
        if not _is_part(info):
            return maps  # type: ignore[no-any-return]
        if roi.x_offset >= info.width or roi.y_offset >= info.height:
            raise Uncalibrated(
                f"the region of interest must begin within {info.width} x {info.height} pixels, "
                f"got ({roi.x_offset}, {roi.y_offset})"
            )
        x, y = roi.x_offset // bin_x, roi.y_offset // bin_y
        part = slice(y, y + roi.height // bin_y), slice(x, x + roi.width // bin_x)
        return (maps[0][part] - np.array([x, y])).astype(np.int16), np.ascontiguousarray(maps[1][part])


def _is_part(info: CameraInfo) -> bool:
    roi = info.roi
    return bool(
        roi.x_offset
        or roi.y_offset
        or (roi.width and roi.width != info.width)
        or (roi.height and roi.height != info.height)
    )
