"""Models of one camera and of two, made of `sensor_msgs/CameraInfo`.

Matrices are `numpy.matrix`, as genuine image_geometry has them, so that `*` multiplies them.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from typing import Any

from pipros.lazy_names import star_names as _star_names
from pipros.vision.distortion import undistorted
from pipros.vision.extras import numpy as np
from pipros.vision.extras import opencv

_star_names(__name__, "cv2 numpy")


def mkmat(rows: int, cols: int, L: Any) -> Any:
    """A matrix of numbers, row by row; what is missing is 0, what is too much is left out."""
    matrix = np.zeros(rows * cols)
    values = np.asarray(L, dtype="float64").ravel()[: rows * cols]
    matrix[: values.size] = values
    return matrix.reshape(rows, cols).view(np.matrix)


class PinholeCameraModel:
    """A camera without a lens: pixels of the rectified image are projections along straight rays.

    Attributes:
        K, P: for the part of the image that the camera sends, by its binning and region of interest; `full_K`
            and `full_P` are those of the full resolution.
        D: the coefficients of the distortion, as a column; None where there is no distortion.
        stamp: that of the message.
    """

    def __init__(self) -> None:
        self.K: Any = None
        self.D: Any = None
        self.R: Any = None
        self.P: Any = None
        self.full_K: Any = None
        self.full_P: Any = None
        self.width: Any = None
        self.height: Any = None
        self.binning_x: Any = None
        self.binning_y: Any = None
        self.raw_roi: Any = None
        self.tf_frame: Any = None
        self.stamp: Any = None

    def fromCameraInfo(self, msg: Any) -> None:
        """Take all parameters of a `sensor_msgs/CameraInfo`."""
        self.K, self.full_K = mkmat(3, 3, msg.K), mkmat(3, 3, msg.K)
        self.P, self.full_P = mkmat(3, 4, msg.P), mkmat(3, 4, msg.P)
        self.R = mkmat(3, 3, msg.R)
        self.D = mkmat(len(msg.D), 1, msg.D) if len(msg.D) else None
        self.width, self.height = msg.width, msg.height
        self.resolution = (msg.width, msg.height)
        self.binning_x, self.binning_y = max(1, msg.binning_x), max(1, msg.binning_y)
        self.tf_frame, self.stamp = msg.header.frame_id, msg.header.stamp
        roi = self.raw_roi = copy.copy(msg.roi)
        if roi.x_offset == roi.y_offset == roi.width == roi.height == 0:  # the whole image
            roi.width, roi.height = self.width, self.height
        for matrix in (self.K, self.P):
            matrix[0, 0] /= self.binning_x
            matrix[1, 1] /= self.binning_y
            matrix[0, 2] = (matrix[0, 2] - roi.x_offset) / self.binning_x
            matrix[1, 2] = (matrix[1, 2] - roi.y_offset) / self.binning_y

    def rectifyImage(self, raw: Any, rectified: Any) -> None:
        """Write the rectified image of the array `raw` into the array `rectified`, by OpenCV.

        Raises:
            ImportError: OpenCV is not installed (`pip install 'pipros[vision]'`).
        """
        cv2 = opencv("rectifying an image")
        self.mapx, self.mapy = cv2.initUndistortRectifyMap(
            self.K, self.D, self.R, self.P, (self.width, self.height), cv2.CV_32FC1
        )
        cv2.remap(raw, self.mapx, self.mapy, cv2.INTER_CUBIC, rectified)

    def rectifyPoint(self, uv_raw: Sequence[float]) -> Any:
        """Where the pixel (u, v) of the raw image is in the rectified one, as an array of two.

        Raises:
            ValueError: the model has another number of coefficients than 4, 5, 8, 12 or 14.
        """
        coefficients = None if self.D is None else self.D.A1
        return undistorted(uv_raw, self.K, coefficients, self.R, self.P)

    def project3dToPixel(self, point: Sequence[float]) -> tuple[float, float]:
        """The rectified pixel (u, v) of a point (x, y, z) in the frame of the camera.

        Not numbers (nan) for a point in the plane of the camera.
        """
        x, y, w = np.asarray(self.P) @ np.array([point[0], point[1], point[2], 1.0])
        if w == 0:
            return math.nan, math.nan
        return x / w, y / w

    def projectPixelTo3dRay(self, uv: Sequence[float]) -> tuple[float, float, float]:
        """The direction (x, y, z), of length 1, in which the camera sees the rectified pixel (u, v)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = (uv[0] - self.cx()) / self.fx(), (uv[1] - self.cy()) / self.fy()
            length = math.sqrt(x * x + y * y + 1)
            return x / length, y / length, 1.0 / length

    def getDeltaU(self, deltaX: float, Z: float) -> float:
        """How many pixels apart points are that are `deltaX` apart at the distance Z."""
        return math.inf if Z == 0 else float(self.fx() * deltaX / Z)

    def getDeltaV(self, deltaY: float, Z: float) -> float:
        """As `getDeltaU`, downwards."""
        return math.inf if Z == 0 else float(self.fy() * deltaY / Z)

    def getDeltaX(self, deltaU: float, Z: float) -> float:
        """How far apart points are at the distance Z whose pixels are `deltaU` apart."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(Z * deltaU / self.fx())

    def getDeltaY(self, deltaV: float, Z: float) -> float:
        """As `getDeltaX`, downwards."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(Z * deltaV / self.fy())

    def fullResolution(self) -> tuple[int, int]:
        """Width and height of the camera's whole image."""
        return self.resolution

    def intrinsicMatrix(self) -> Any:
        """K, for the part of the image that the camera sends."""
        return self.K

    def distortionCoeffs(self) -> Any:
        """D; None for no distortion."""
        return self.D

    def rotationMatrix(self) -> Any:
        """R, which turns the camera into the rectified one."""
        return self.R

    def projectionMatrix(self) -> Any:
        """P, for the part of the image that the camera sends."""
        return self.P

    def fullIntrinsicMatrix(self) -> Any:
        """K of the full resolution."""
        return self.full_K

    def fullProjectionMatrix(self) -> Any:
        """P of the full resolution."""
        return self.full_P

    def cx(self) -> float:
        """The column of the rectified pixel straight ahead."""
        return self.P[0, 2]  # type: ignore[no-any-return]

    def cy(self) -> float:
        """The row of the rectified pixel straight ahead."""
        return self.P[1, 2]  # type: ignore[no-any-return]

    def fx(self) -> float:
        """The focal length in columns."""
        return self.P[0, 0]  # type: ignore[no-any-return]

    def fy(self) -> float:
        """The focal length in rows."""
        return self.P[1, 1]  # type: ignore[no-any-return]

    def Tx(self) -> float:
        """The first value of P's last column: for the right one of two cameras, -fx times their distance."""
        return self.P[0, 3]  # type: ignore[no-any-return]

    def Ty(self) -> float:
        """The second value of P's last column."""
        return self.P[1, 3]  # type: ignore[no-any-return]

    def fovX(self) -> float:
        """The angle from the left edge of the image to the right one, in radians."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return 2 * math.atan(self.width / (2 * self.fx()))

    def fovY(self) -> float:
        """The angle from the upper edge of the image to the lower one, in radians."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return 2 * math.atan(self.height / (2 * self.fy()))

    def tfFrame(self) -> str:
        """The frame of the camera."""
        return self.tf_frame  # type: ignore[no-any-return]


class StereoCameraModel:
    """Two rectified cameras side by side; points are in the frame of the left one."""

    def __init__(self) -> None:
        self.left, self.right = PinholeCameraModel(), PinholeCameraModel()

    def fromCameraInfo(self, left_msg: Any, right_msg: Any) -> None:
        """Take the parameters of both cameras from two `sensor_msgs/CameraInfo`."""
        self.left.fromCameraInfo(left_msg)
        self.right.fromCameraInfo(right_msg)
        fx = self.right.fx()
        with np.errstate(divide="ignore", invalid="ignore"):
            baseline = -self.right.Tx() / fx
            # From (u, v, disparity, 1) to a point, times its last value.
            self.Q = np.zeros((4, 4))
            self.Q[0, 0] = self.Q[1, 1] = 1.0
            self.Q[:3, 3] = -self.right.cx(), -self.right.cy(), fx
            self.Q[3, 2] = 1 / baseline

    def tfFrame(self) -> str:
        """The frame of the points: that of the left camera."""
        return self.left.tfFrame()

    def project3dToPixel(self, point: Sequence[float]) -> tuple[tuple[float, float], tuple[float, float]]:
        """The rectified pixels ((u, v), (u, v)) of a point in the left and in the right image."""
        return self.left.project3dToPixel(point), self.right.project3dToPixel(point)

    def projectPixelTo3d(self, left_uv: Sequence[float], disparity: float) -> tuple[float, float, float]:
        """The point (x, y, z) of a rectified pixel of the left image; zeros for a disparity of 0.

        Args:
            disparity: how many columns further left it is in the right image.
        """
        with np.errstate(invalid="ignore"):
            x, y, z, w = self.Q @ np.array([left_uv[0], left_uv[1], disparity, 1.0])
            return (x / w, y / w, z / w) if w != 0 else (0.0, 0.0, 0.0)

    def getZ(self, disparity: float) -> float:
        """The depth of points with this disparity; infinite for 0."""
        return math.inf if disparity == 0 else float(-self.right.Tx() / disparity)

    def getDisparity(self, Z: float) -> float:
        """The disparity of points at this depth; infinite for 0."""
        return math.inf if Z == 0 else float(-self.right.Tx() / Z)
