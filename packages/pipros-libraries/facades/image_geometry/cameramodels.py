"""Pinhole and stereo camera models, set up from `sensor_msgs/CameraInfo`.

Matrices are `numpy.matrix`, as in Noetic, so that `*` is the matrix product. Pixels are (u, v): column, row.
Camera frames have x to the right, y down and z forward; lengths are in metres, as in CameraInfo.
"""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING, Any

from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.vision.distortion import undistorted
from pipros_libraries.vision.extras import numpy as np
from pipros_libraries.vision.opencv import opencv

if TYPE_CHECKING:
    from pipros.msg.stub_types import Indexable

_star_names(__name__, "cv2 numpy")


def mkmat(rows: int, cols: int, L: Any) -> Any:
    """Return a matrix filled row by row with the values in `L`.

    Missing values are 0; surplus values are ignored.
    """
    matrix = np.zeros(rows * cols)
    values = np.asarray(L, dtype="float64").ravel()[: rows * cols]
    matrix[: values.size] = values
    return matrix.reshape(rows, cols).view(np.matrix)


class PinholeCameraModel:
    """Pinhole camera model, for the rectified image unless stated otherwise.

    Attributes:
        K, P: matrices (3x3, 3x4) for the published image, adjusted for binning and region of interest;
            `full_K` and `full_P` are K and P at full resolution.
        D: distortion coefficients as a column, or None if there is no distortion.
        stamp: timestamp of the message.
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
        """Set all parameters from a `sensor_msgs/CameraInfo`."""
        self.K, self.full_K = mkmat(3, 3, msg.K), mkmat(3, 3, msg.K)
        self.P, self.full_P = mkmat(3, 4, msg.P), mkmat(3, 4, msg.P)
        self.R = mkmat(3, 3, msg.R)
        self.D = mkmat(len(msg.D), 1, msg.D) if len(msg.D) else None
        self.width, self.height = msg.width, msg.height
        self.resolution = (msg.width, msg.height)
        self.binning_x, self.binning_y = max(1, msg.binning_x), max(1, msg.binning_y)
        self.tf_frame, self.stamp = msg.header.frame_id, msg.header.stamp
        roi = self.raw_roi = copy.copy(msg.roi)
        if roi.x_offset == roi.y_offset == roi.width == roi.height == 0:  # all zeros: the whole image
            roi.width, roi.height = self.width, self.height
        for matrix in (self.K, self.P):
            matrix[0, 0] /= self.binning_x
            matrix[1, 1] /= self.binning_y
            matrix[0, 2] = (matrix[0, 2] - roi.x_offset) / self.binning_x
            matrix[1, 2] = (matrix[1, 2] - roi.y_offset) / self.binning_y

    def rectifyImage(self, raw: Any, rectified: Any) -> None:
        """Rectify the image array `raw` with OpenCV and write the result to the array `rectified`.

        Raises:
            ImportError: OpenCV is not installed (`pip install 'pipros[vision]'`).
        """
        cv2 = opencv("rectifying an image")
        self.mapx, self.mapy = cv2.initUndistortRectifyMap(
            self.K, self.D, self.R, self.P, (self.width, self.height), cv2.CV_32FC1
        )
        cv2.remap(raw, self.mapx, self.mapy, cv2.INTER_CUBIC, rectified)

    def rectifyPoint(self, uv_raw: Any) -> Any:
        """Convert the pixel (u, v) of the raw image to a rectified pixel. Return an array of shape (2,).

        Raises:
            ValueError: the number of distortion coefficients is not 4, 5, 8, 12 or 14.
        """
        coefficients = None if self.D is None else self.D.A1
        return undistorted(uv_raw, self.K, coefficients, self.R, self.P)

    def project3dToPixel(self, point: Indexable) -> tuple[float, float]:
        """Project a point (x, y, z) in the camera frame to the rectified pixel (u, v).

        Return NaN for a point in the camera plane.
        """
        x, y, w = np.asarray(self.P) @ np.array([point[0], point[1], point[2], 1.0])
        if w == 0:
            return math.nan, math.nan
        return x / w, y / w

    def projectPixelTo3dRay(self, uv: Indexable) -> tuple[float, float, float]:
        """Return the unit vector (x, y, z) of the ray through the rectified pixel (u, v)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = (uv[0] - self.cx()) / self.fx(), (uv[1] - self.cy()) / self.fy()
            length = math.sqrt(x * x + y * y + 1)
            return x / length, y / length, 1.0 / length

    def getDeltaU(self, deltaX: float, Z: float) -> float:
        """Return the horizontal distance in pixels between points that are `deltaX` apart at depth `Z`."""
        return math.inf if Z == 0 else float(self.fx() * deltaX / Z)

    def getDeltaV(self, deltaY: float, Z: float) -> float:
        """Return the vertical distance in pixels between points that are `deltaY` apart at depth `Z`."""
        return math.inf if Z == 0 else float(self.fy() * deltaY / Z)

    def getDeltaX(self, deltaU: float, Z: float) -> float:
        """Return the horizontal distance between points at depth `Z` whose pixels are `deltaU` apart."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(Z * deltaU / self.fx())

    def getDeltaY(self, deltaV: float, Z: float) -> float:
        """Return the vertical distance between points at depth `Z` whose pixels are `deltaV` apart."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(Z * deltaV / self.fy())

    def fullResolution(self) -> tuple[int, int]:
        """Return the width and height of the full-resolution image in pixels."""
        return self.resolution

    def intrinsicMatrix(self) -> Any:
        """Return K, adjusted for binning and region of interest."""
        return self.K

    def distortionCoeffs(self) -> Any:
        """Return D, or None if there is no distortion."""
        return self.D

    def rotationMatrix(self) -> Any:
        """Return R, the rotation from the camera to the rectified camera."""
        return self.R

    def projectionMatrix(self) -> Any:
        """Return P, adjusted for binning and region of interest."""
        return self.P

    def fullIntrinsicMatrix(self) -> Any:
        """Return K at full resolution."""
        return self.full_K

    def fullProjectionMatrix(self) -> Any:
        """Return P at full resolution."""
        return self.full_P

    def cx(self) -> float:
        """Return the column of the principal point."""
        return self.P[0, 2]  # type: ignore[no-any-return]

    def cy(self) -> float:
        """Return the row of the principal point."""
        return self.P[1, 2]  # type: ignore[no-any-return]

    def fx(self) -> float:
        """Return the horizontal focal length in pixels."""
        return self.P[0, 0]  # type: ignore[no-any-return]

    def fy(self) -> float:
        """Return the vertical focal length in pixels."""
        return self.P[1, 1]  # type: ignore[no-any-return]

    def Tx(self) -> float:
        """Return P[0, 3], which is -fx times the baseline for the right camera of a stereo pair."""
        return self.P[0, 3]  # type: ignore[no-any-return]

    def Ty(self) -> float:
        """Return P[1, 3], which is zero for a horizontal stereo pair."""
        return self.P[1, 3]  # type: ignore[no-any-return]

    def fovX(self) -> float:
        """Return the horizontal field of view in radians."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return 2 * math.atan(self.width / (2 * self.fx()))

    def fovY(self) -> float:
        """Return the vertical field of view in radians."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return 2 * math.atan(self.height / (2 * self.fy()))

    def tfFrame(self) -> str:
        """Return the frame ID of the camera."""
        return self.tf_frame  # type: ignore[no-any-return]


class StereoCameraModel:
    """Model of a horizontal stereo pair of rectified cameras. Points are in the frame of the left camera."""

    def __init__(self) -> None:
        self.left, self.right = PinholeCameraModel(), PinholeCameraModel()

    def fromCameraInfo(self, left_msg: Any, right_msg: Any) -> None:
        """Set the parameters of both cameras from two `sensor_msgs/CameraInfo`."""
        self.left.fromCameraInfo(left_msg)
        self.right.fromCameraInfo(right_msg)
        fx = self.right.fx()
        with np.errstate(divide="ignore", invalid="ignore"):
            baseline = -self.right.Tx() / fx
            # Q maps (u, v, disparity, 1) to the homogeneous coordinates of a point.
            self.Q = np.zeros((4, 4))
            self.Q[0, 0] = self.Q[1, 1] = 1.0
            self.Q[:3, 3] = -self.right.cx(), -self.right.cy(), fx
            self.Q[3, 2] = 1 / baseline

    def tfFrame(self) -> str:
        """Return the frame ID of the left camera."""
        return self.left.tfFrame()

    def project3dToPixel(self, point: Indexable) -> tuple[tuple[float, float], tuple[float, float]]:
        """Project a point (x, y, z) to the rectified pixels (u, v) of the left and the right image."""
        return self.left.project3dToPixel(point), self.right.project3dToPixel(point)

    def projectPixelTo3d(self, left_uv: Indexable, disparity: float) -> tuple[float, float, float]:
        """Return the point (x, y, z) for a rectified pixel of the left image, or zeros if the disparity is 0.

        Args:
            disparity: column in the left image minus column in the right image.
        """
        with np.errstate(invalid="ignore"):
            x, y, z, w = self.Q @ np.array([left_uv[0], left_uv[1], disparity, 1.0])
            return (x / w, y / w, z / w) if w != 0 else (0.0, 0.0, 0.0)

    def getZ(self, disparity: float) -> float:
        """Return the depth of points with the given disparity, or infinity if the disparity is 0."""
        return math.inf if disparity == 0 else float(-self.right.Tx() / disparity)

    def getDisparity(self, Z: float) -> float:
        """Return the disparity of points at the given depth, or infinity if the depth is 0."""
        return math.inf if Z == 0 else float(-self.right.Tx() / Z)
