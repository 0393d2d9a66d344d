"""image_geometry: models of cameras."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, RegionOfInterest

from image_geometry import PinholeCameraModel, StereoCameraModel
from image_geometry.cameramodels import mkmat


def info(**more: Any) -> CameraInfo:
    found = CameraInfo(width=640, height=480, **more)
    found.header.frame_id = "camera"
    found.K = [500, 0, 320, 0, 400, 240, 0, 0, 1]
    found.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    found.P = [500, 0, 320, -50, 0, 400, 240, 0, 0, 0, 1, 0]
    return found


def model(**more: Any) -> PinholeCameraModel:
    found = PinholeCameraModel()
    found.fromCameraInfo(info(**more))
    return found


def test_pixels_and_rays_are_inverse() -> None:
    camera = model()

    x, y, z = camera.projectPixelTo3dRay((100, 50))
    u, v = camera.project3dToPixel((x * 7, y * 7, z * 7))

    assert math.isclose(x * x + y * y + z * z, 1)
    assert (u, v) == pytest.approx((100 - 50 / (7 * z), 50))
    assert all(map(math.isnan, camera.project3dToPixel((1, 2, 0))))


def test_a_camera_model_returns_its_calibration() -> None:
    camera = model(D=[0.1, 0, 0, 0, 0])

    assert (camera.fx(), camera.fy(), camera.cx(), camera.cy(), camera.Tx(), camera.Ty()) == (
        *(500, 400, 320, 240),
        *(-50, 0),
    )
    assert camera.tfFrame() == "camera"
    assert camera.fullResolution() == (640, 480)
    assert camera.fovX() == 2 * math.atan(640 / 1000)
    assert camera.fovY() == 2 * math.atan(480 / 800)
    assert camera.distortionCoeffs().shape == (5, 1)
    assert (camera.intrinsicMatrix() @ camera.rotationMatrix() == camera.fullIntrinsicMatrix()).all()
    assert (camera.projectionMatrix() == camera.fullProjectionMatrix()).all()
    assert isinstance(camera.K, np.matrix)


def test_binning_and_a_region_change_what_pixels_mean() -> None:
    camera = model(binning_x=2, roi=RegionOfInterest(x_offset=20, y_offset=40, width=100, height=100))

    assert (camera.fx(), camera.fy(), camera.cx(), camera.cy()) == (250, 400, 150, 200)
    assert camera.full_P[0, 2] == 320
    assert camera.raw_roi.width == 100
    assert model().raw_roi.width == 640


def test_distances_in_pixels_and_in_space() -> None:
    camera = model()

    assert (camera.getDeltaU(2, 4), camera.getDeltaV(2, 4)) == (250, 200)
    assert (camera.getDeltaX(250, 4), camera.getDeltaY(200, 4)) == (2, 2)
    assert (camera.getDeltaU(2, 0), camera.getDeltaV(2, 0)) == (math.inf, math.inf)


def test_points_are_undistorted_like_opencv() -> None:
    # The results of undistortPoints in OpenCV 4.6.
    camera = model(D=[-0.2, 0.05, 0.001, 0.002, 0.01])

    assert camera.rectifyPoint((100, 50)).tolist() == pytest.approx(
        [77.57244945783413, 30.889853319023587], rel=1e-12
    )
    assert model().rectifyPoint((100, 50)).tolist() == pytest.approx([100, 50])


def test_a_wrong_number_of_distortion_coefficients_is_explained() -> None:
    with pytest.raises(ValueError, match="must be 4, 5, 8, 12 or 14, got 3"):
        model(D=[1, 2, 3]).rectifyPoint((1, 2))


def test_a_camera_without_calibration_gives_no_numbers_and_no_warnings() -> None:
    camera, pair = PinholeCameraModel(), StereoCameraModel()
    camera.fromCameraInfo(CameraInfo(width=640, height=480))
    pair.fromCameraInfo(CameraInfo(), CameraInfo())

    assert np.isnan(camera.projectPixelTo3dRay((1, 2))).any()
    assert np.isnan(camera.rectifyPoint((1, 2))).all()
    assert camera.fovX() == math.pi
    assert all(math.isnan(value) for value in camera.project3dToPixel((1, 2, 3)))
    assert not np.isfinite(pair.projectPixelTo3d((1, 2), 3)).all()


def test_two_cameras_see_depth() -> None:
    pair = StereoCameraModel()
    left = info()
    left.P = [500, 0, 320, 0, 0, 400, 240, 0, 0, 0, 1, 0]
    pair.fromCameraInfo(left, info())

    (left_u, v), (right_u, _) = pair.project3dToPixel((0.2, 0.1, 2.0))

    assert pair.tfFrame() == "camera"
    assert pair.getZ(left_u - right_u) == 2.0
    assert pair.getDisparity(2.0) == left_u - right_u
    assert pair.projectPixelTo3d((left_u, v), left_u - right_u)[2] == 2.0
    assert (pair.getZ(0), pair.getDisparity(0)) == (math.inf, math.inf)
    assert pair.projectPixelTo3d((1, 2), 0) == (0, 0, 0)


def test_matrices_are_filled_and_cut() -> None:
    assert mkmat(2, 2, [1, 2, 3]).tolist() == [[1, 2], [3, 0]]
    assert mkmat(1, 2, [1, 2, 3]).tolist() == [[1, 2]]


def test_images_are_rectified_by_opencv(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)

    with pytest.raises(ImportError, match=r"rectifying an image needs OpenCV.*\[vision\]"):
        model().rectifyImage(np.zeros((480, 640)), np.zeros((480, 640)))
