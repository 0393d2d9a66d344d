"""Cases by hand; `tests.interop.test_image_nodelets_as_genuine` has the genuine nodelets beside ours."""

from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros_libraries.pictures.encodings import COLORS, DTYPES
from pipros_robot.perception.images.arrays import BadImage, array_of, image_message
from pipros_robot.perception.images.bayer import VNG, colors, gray
from pipros_robot.perception.images.clouds import cloud_message, empty_points, set_colors
from pipros_robot.perception.images.depths import checked, converted_metric, registered, set_points
from pipros_robot.perception.images.disparity_view import shown
from pipros_robot.perception.images.matching import SETTINGS, BlockMatcher, corrected
from pipros_robot.perception.images.pinhole import Pinhole, Rectifier, Uncalibrated
from pipros_robot.perception.images.stereo_cloud import positions
from tests.support.pictures_of_cameras import camera_info, image, right_info

CAMERA = Pinhole(fx=100, fy=100, cx=1, cy=1)


def test_arrays_share_the_memory_of_messages_and_skip_padding() -> None:
    message = image(np.array([[1, 2, 9], [3, 4, 9]], np.uint16), "mono16", 1)
    message.width = 2
    assert array_of(message).tolist() == [[1, 2], [3, 4]]
    message.is_bigendian = 1
    assert array_of(message).tolist() == [[256, 512], [768, 1024]]
    made = image_message(np.arange(12, dtype=np.uint8).reshape(2, 2, 3), "bgr8", message.header)
    assert (made.step, bytes(made.data)) == (6, bytes(range(12)))
    assert np.shares_memory(array_of(made), made.data)
    assert made.header is not message.header


@pytest.mark.parametrize(("fields", "reason"), [
    ({"encoding": "rainbow"}, r"unknown encoding \[rainbow\]"),
    ({"height": 3}, "2 x 3 pixels of mono8 need 3 rows of 2 bytes, got 4 bytes in rows of 2"),
    ({"step": 1}, "in rows of 1"), ({"width": 0}, "must have pixels, got 0 x 2"),
])  # fmt: skip
def test_images_with_missing_pixels_are_refused(fields: dict[str, Any], reason: str) -> None:
    message = image(np.zeros((2, 2), np.uint8), "mono8", 1)
    for name, value in fields.items():
        setattr(message, name, value)
    with pytest.raises(BadImage, match=reason):
        array_of(message)


def test_raw_images_without_defined_colors_are_refused() -> None:
    with pytest.raises(BadImage, match="ambiguous"):
        colors(np.zeros((2, 2, 3), np.uint8), "8UC3", 0)
    with pytest.raises(BadImage, match=r"cannot convert \[32FC1\] to colour"):
        colors(np.zeros((2, 2), np.float32), "32FC1", 0)
    with pytest.raises(BadImage, match="VNG needs 8 bits"):
        colors(np.zeros((4, 4), np.uint16), "bayer_rggb16", VNG)
    with pytest.raises(BadImage, match="to grey"):
        gray(np.zeros((2, 2), np.float32), "32FC1")


def test_edge_aware_methods_and_vng_keep_a_plain_color() -> None:
    mosaic = np.tile(np.array([[100, 200], [50, 100]], np.uint8), (8, 8))
    for method in (0, 1, 2, 3):
        found, name = colors(mosaic, "bayer_grbg8", method)
        assert name == "bgr8"
        assert (found[4:-4, 4:-4] == (50, 100, 200)).all()


def test_cameras_without_calibration_are_refused() -> None:
    with pytest.raises(Uncalibrated, match="K has no focal length"):
        Rectifier(camera_info(1, K=[0.0] * 9))
    with pytest.raises(Uncalibrated, match="distortion model must be plumb_bob"):
        Rectifier(camera_info(1, distortion_model="bent"))
    with pytest.raises(Uncalibrated, match="1 to 67108864 pixels, got 100000 x 100000"):
        Rectifier(camera_info(1, width=100_000, height=100_000))
    with pytest.raises(Uncalibrated, match="P has no focal length"):
        Pinhole.of(camera_info(1, P=[0.0] * 12))
    assert not Rectifier(camera_info(1, D=[0.0] * 5, R=[0, 1, 0, 1, 0, 0, 0, 0, 1])).is_needed


def test_a_region_of_interest_outside_the_image_is_refused() -> None:
    info = camera_info(1)
    info.roi.x_offset, info.roi.width = 65_536, 64
    with pytest.raises(Uncalibrated, match=r"must begin within \d+ x \d+ pixels, got \(65536, 0\)"):
        Rectifier(info).rectified(np.zeros((info.height, info.width), np.uint8), 1)


def test_points_of_depths() -> None:
    points = empty_points(2, 3, has_colors=False)
    set_points(points, np.array([[1000, 0, 2000], [0, 500, 0]], np.uint16), "16UC1", CAMERA)
    assert points[0, 0, :3] == pytest.approx([-0.01, -0.01, 1])
    assert points[0, 2, :3] == pytest.approx([0.02, -0.02, 2])
    assert points[1, 1, :3] == pytest.approx([0, 0, 0.5])
    assert np.isnan(points[0, 1, :3]).all()
    with pytest.raises(BadImage, match="must be 16UC1 or 32FC1"):
        checked("8UC1")


def test_units_of_depths() -> None:
    metres, name = converted_metric(np.array([[0, 1500]], np.uint16), "16UC1")
    assert (name, metres[0, 1], np.isnan(metres[0, 0])) == ("32FC1", pytest.approx(1.5), True)
    back, name = converted_metric(np.array([[np.nan, np.inf, 1.2345]], np.float32), "32FC1")
    assert (name, back.tolist()) == ("16UC1", [[0, 0, 1234]])


def test_the_nearest_depth_wins_and_one_depth_can_fill_several_pixels() -> None:
    depths = np.array([[1000, 2000, 0]], np.uint16)
    half = Pinhole(fx=1, fy=100, cx=0, cy=1)
    assert registered(depths, "16UC1", CAMERA, half, (1, 2), np.eye(4)).tolist() == [[1000, 0]]
    double = Pinhole(fx=200, fy=100, cx=2, cy=1)
    filled = registered(depths, "16UC1", CAMERA, double, (3, 6), np.eye(4), fills_holes=True)
    assert (filled > 0).sum() > 4
    behind = np.diag([1.0, 1, -1, 1])
    assert not registered(depths, "16UC1", CAMERA, CAMERA, (1, 3), behind).any()


def test_colors_of_points_are_packed_as_blue_green_red() -> None:
    points = empty_points(1, 1, has_colors=True)
    set_colors(points, np.array([[[1, 2, 3]]], np.uint8), "rgb8", alpha=255)
    assert points[0, 0, 4:5].view(np.uint8).tolist() == [3, 2, 1, 255]
    with pytest.raises(BadImage):
        set_colors(points, np.zeros((1, 1), np.float32), "32FC1", alpha=0)


def test_settings_of_matchers_are_corrected_and_bound_the_valid_window() -> None:
    values = {each.name: each.default for each in SETTINGS} | {"stereo_algorithm": 0}
    fixed = corrected(values | {"correlation_window_size": 8, "disparity_range": 70})
    assert (fixed["correlation_window_size"], fixed["disparity_range"]) == (9, 64)
    assert BlockMatcher(fixed).valid_window(640, 480) == (67, 4, 568, 471)
    below = BlockMatcher(corrected(values | {"min_disparity": -16}))
    assert below.valid_window(640, 480) == (54, 7, 569, 465)


def test_positions_of_disparities() -> None:
    left, right = Pinhole.of(camera_info(1)), Pinhole.of(right_info(1))
    disparities = np.array([[-1, 10, 0]], np.float32)
    found = positions(disparities, left, right)
    assert np.isnan(found[0, 0]).all()
    assert np.isnan(found[0, 2]).all()
    assert found[0, 1, 2] == pytest.approx(left.fx * 0.12 / 10)
    with pytest.raises(BadImage, match="no baseline"):
        positions(disparities, left, left)


def test_disparities_are_shown_from_blue_to_red() -> None:
    message: Any = load_message_class("stereo_msgs/DisparityImage")(min_disparity=0.0, max_disparity=10.0)
    message.image = image(np.array([[0, 10]], np.float32), "32FC1", 1)
    (low, high) = shown(message)[0].tolist()
    assert low[0] > low[2]
    assert high[2] > high[0]
    message.max_disparity = 0.0
    with pytest.raises(BadImage, match="must differ"):
        shown(message)
    message.image.encoding = "mono8"
    with pytest.raises(BadImage, match="must be 32FC1"):
        shown(message)


# Every message results in an array, or in the documented error.


Image: Any = load_message_class("sensor_msgs/Image")
NAMES = st.sampled_from([*COLORS, *(f"{depth}C{n}" for depth in DTYPES for n in (1, 3, 9))]) | st.text(
    max_size=9
)
SIZES = st.integers(0, 12) | st.integers(0, 2**32 - 1)
NUMBERS = st.floats(width=64)


@given(SIZES, SIZES, NAMES, st.integers(0, 1), SIZES, st.binary(max_size=600), st.integers(0, 3))
def test_any_image_is_converted_or_refused(
    height: int, width: int, name: str, is_big: int, step: int, data: bytes, method: int
) -> None:
    message = Image(height=height, width=width, encoding=name, is_bigendian=is_big, step=step, data=data)
    try:
        array = array_of(message)
    except PiprosError:
        return
    assert array.shape[:2] == (height, width)
    for convert in (gray, lambda image, kind: colors(image, kind, method)):
        try:
            found, _ = convert(array, name)
        except (PiprosError, cv2.error):
            continue
        assert found.shape[:2] == (height, width)
    points = empty_points(height, width, has_colors=True)
    try:
        set_points(points, array, name, Pinhole(1, 1, 0, 0))
        set_colors(points, array, name, 0)
    except PiprosError:
        return
    assert len(cloud_message(points, message.header).data) == height * width * 32


@given(SIZES, SIZES, st.lists(NUMBERS, max_size=9), st.lists(NUMBERS, min_size=9, max_size=9))
def test_any_calibration_rectifies_or_is_refused(
    height: int, width: int, distortion: list[float], matrix: list[float]
) -> None:
    info = camera_info(1, size=(height % 50 or height, width), D=distortion, K=matrix)
    try:
        rectifier = Rectifier(info)
        found = rectifier.rectified(np.zeros((height % 50 or 1, min(width, 50) or 1), np.uint8), 1)
    except (PiprosError, cv2.error):
        return
    assert found.dtype == np.uint8
