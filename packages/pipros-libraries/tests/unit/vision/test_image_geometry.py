"""image_geometry: models of cameras."""

import math
import sys
from math import pi
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from sensor_msgs import point_cloud2
from sensor_msgs.msg import CameraInfo, LaserScan, PointCloud2, RegionOfInterest

import angles
from image_geometry import PinholeCameraModel, StereoCameraModel
from image_geometry.cameramodels import mkmat
from laser_geometry import LaserProjection
from pipros_libraries.vision.capture import CameraError, Capture


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
    assert (camera.tfFrame(), camera.fullResolution()) == ("camera", (640, 480))
    assert camera.fovX() == 2 * math.atan(640 / 1000)
    assert camera.fovY() == 2 * math.atan(480 / 800)
    assert camera.distortionCoeffs().shape == (5, 1)
    assert (camera.intrinsicMatrix() @ camera.rotationMatrix() == camera.fullIntrinsicMatrix()).all()
    assert (camera.projectionMatrix() == camera.fullProjectionMatrix()).all()
    assert isinstance(camera.K, np.matrix)


def test_binning_and_a_region_change_what_pixels_mean() -> None:
    camera = model(binning_x=2, roi=RegionOfInterest(x_offset=20, y_offset=40, width=100, height=100))

    assert (camera.fx(), camera.fy(), camera.cx(), camera.cy()) == (250, 400, 150, 200)
    assert (camera.full_P[0, 2], camera.raw_roi.width) == (320, 100)
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

    assert (pair.tfFrame(), pair.getZ(left_u - right_u)) == ("camera", 2.0)
    assert pair.getDisparity(2.0) == left_u - right_u
    assert pair.projectPixelTo3d((left_u, v), left_u - right_u)[2] == 2.0
    assert (pair.getZ(0), pair.getDisparity(0)) == (math.inf, math.inf)
    assert pair.projectPixelTo3d((1, 2), 0) == (0, 0, 0)


def test_matrices_are_filled_and_cut() -> None:
    assert (mkmat(2, 2, [1, 2, 3]).tolist(), mkmat(1, 2, [1, 2, 3]).tolist()) == ([[1, 2], [3, 0]], [[1, 2]])


def test_images_are_rectified_by_opencv(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)

    with pytest.raises(ImportError, match=r"rectifying an image needs OpenCV.*\[vision\]"):
        model().rectifyImage(np.zeros((480, 640)), np.zeros((480, 640)))


# Cameras and videos, read with OpenCV.


WIDTH, HEIGHT = 64, 48


@pytest.fixture
def video(tmp_path: Path) -> str:
    """A video of two red pictures."""
    path = str(tmp_path / "video.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (WIDTH, HEIGHT))
    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    picture[:, :, 2] = 255  # OpenCV's order is blue, green, red
    for _ in range(2):
        writer.write(picture)
    writer.release()
    return path


def test_a_video_gives_its_images_as_rgb_until_it_ends(video: str) -> None:
    capture = Capture(video, WIDTH, HEIGHT, 30.0, "mjpeg")

    for _ in range(2):
        image = capture.read()
        assert image.shape == (HEIGHT, WIDTH, 3)
        assert image[HEIGHT // 2, WIDTH // 2].tolist() == pytest.approx([255, 0, 0], abs=3)
    with pytest.raises(CameraError, match=r"cannot read an image from .*video\.avi"):
        capture.read()
    capture.close()


def test_a_device_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match=r"cannot open the camera .*none"):
        Capture(str(tmp_path / "none"), WIDTH, HEIGHT, 30.0, "yuyv")


def test_an_unknown_pixel_format_is_refused(video: str) -> None:
    with pytest.raises(CameraError, match=r"pixel_format must be one of yuyv, .* got 'h264'"):
        Capture(video, WIDTH, HEIGHT, 30.0, "h264")


# laser_geometry and angles.


EVERYTHING = 0x1F


def scan(*ranges: float, intensities: tuple[float, ...] = ()) -> LaserScan:
    found = LaserScan(
        angle_min=0, angle_increment=pi / 2, time_increment=0.5, range_min=0.5, range_max=10, ranges=ranges,
        intensities=intensities,
    )  # fmt: skip
    found.header.frame_id = "laser"
    return found


def points(cloud: PointCloud2) -> list[tuple[float, ...]]:
    return [tuple(round(value, 5) for value in point) for point in point_cloud2.read_points(cloud)]


def test_ranges_within_the_limits_become_points() -> None:
    cloud = LaserProjection().projectLaser(scan(1, 2, 0.4, 10, math.nan, math.inf, 3))

    assert points(cloud) == [(1, 0, 0, 0), (0, 2, 0, 1), (-3, 0, 0, 6)]
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "index"]
    assert (cloud.header.frame_id, cloud.height, cloud.width, cloud.row_step) == ("laser", 1, 3, 48)


def test_a_point_has_the_requested_channels() -> None:
    cloud = LaserProjection().projectLaser(scan(1, 2, intensities=(7, 8)), 1.5, EVERYTHING)

    names = ["x", "y", "z", "intensity", "index", "distances", "stamps", "vp_x", "vp_y", "vp_z"]
    assert [field.name for field in cloud.fields] == names
    assert points(cloud) == [(1, 0, 0, 7, 0, 1, 0, 0, 0, 0)]
    plain = LaserProjection().projectLaser(scan(1), channel_options=LaserProjection.ChannelOption.NONE)
    assert [field.name for field in plain.fields] == ["x", "y", "z"]


def test_scans_of_another_shape_have_other_directions() -> None:
    projection, other = LaserProjection(), scan(1, 2)
    projection.projectLaser(scan(1, 2))
    other.angle_increment = pi

    assert points(projection.projectLaser(other))[1] == (-2, 0, 0, 1)


def test_an_empty_scan_is_an_empty_cloud() -> None:
    assert LaserProjection().projectLaser(scan()).width == 0


def test_missing_intensities_are_refused() -> None:
    with pytest.raises(IndexError, match="must have an intensity for each range, got 1 for 2"):
        LaserProjection().projectLaser(scan(1, 2, intensities=(7,)))


@pytest.mark.parametrize(("angle", "normal"), [(0, 0), (3 * pi, pi), (-pi, pi), (1.5 * pi, -0.5 * pi)])
def test_angles_are_normalized(angle: float, normal: float) -> None:
    assert angles.normalize_angle(angle) == normal
    assert angles.normalize_angle_positive(angle) == angle % (2 * pi)


def test_the_shortest_turn_crosses_the_seam() -> None:
    assert angles.shortest_angular_distance(3, -3) == pytest.approx(2 * pi - 6)
    assert (angles.two_pi_complement(pi / 2), angles.two_pi_complement(0)) == (-1.5 * pi, 2 * pi)
    assert angles.two_pi_complement(5 * pi) == -pi


def test_a_turn_keeps_the_limits_of_a_joint() -> None:
    within = angles.shortest_angular_distance_with_limits

    assert (within(-0.5, 0.5, -1, 1), within(-0.5, 0.5, 0.25, -0.25)) == ((True, 1.0), (True, 1.0 - 2 * pi))
    assert not within(-0.5, 0.5, -0.25, 0.25)[0]
    assert within(-0.5, 0.5, -pi, pi)[0]


def test_a_joint_may_turn_further_than_once() -> None:
    within = angles.shortest_angular_distance_with_large_limits

    assert within(0, 10.5 * pi, -2 * pi, 2 * pi) == (True, pytest.approx(0.5 * pi))
    assert within(0, 10.5 * pi, -2 * pi, 0.1 * pi) == (True, pytest.approx(-1.5 * pi))
    assert not within(10.5 * pi, 0, -2 * pi, 2 * pi)[0]
    assert not within(0, 1, 2, 1)[0]
    assert not within(0, 1, -0.5, 0.5)[0]


def test_nan_stays_nan() -> None:
    assert math.isnan(angles.normalize_angle(math.nan))
    assert math.isnan(angles.shortest_angular_distance_with_limits(math.nan, 0, -1, 1)[1])
