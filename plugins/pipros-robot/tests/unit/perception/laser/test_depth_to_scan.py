"""Cases computed by hand; tests.golden.navigation.test_laser_as_genuine compares with the genuine node."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from pipros_robot.perception.laser.depth_to_scan import DepthToScan, InvalidDepthImage, view_of


def camera(focal: float = 2.0) -> Any:
    """Return the information about a camera with 5 x 3 pixels, whose centre is at (2, 1)."""
    info: Any = load_message_class("sensor_msgs/CameraInfo")()
    info.K, info.R = [focal, 0, 2, 0, focal, 1, 0, 0, 1], [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [focal, 0, 2, 0, 0, focal, 1, 0, 0, 0, 1, 0]
    return info


def image(rows: Any, encoding: str = "32FC1") -> Any:
    depths = np.array(rows, np.float32 if encoding == "32FC1" else np.uint16)
    made: Any = load_message_class("sensor_msgs/Image")()
    made.height, made.width = depths.shape
    made.encoding, made.step, made.data = encoding, depths.strides[0], depths.tobytes()
    return made


def test_the_first_beam_is_the_rightmost_column() -> None:
    view = view_of(camera(), 5)
    assert (view.angle_min, view.angle_max) == pytest.approx((-math.pi / 4, math.pi / 4))
    middle = [1.0, 2.0, 3.0, math.nan, 5.0]
    found = DepthToScan().ranges(image([[9] * 5, middle, [9] * 5]), view)
    assert (found[0], found[2]) == (pytest.approx(5 * math.sqrt(2)), 3.0)
    assert np.nanmin(found[3:]) == pytest.approx(math.sqrt(2))  # the edge of two beams
    assert math.isnan(found[1])


def test_of_several_rows_the_nearest_valid_depth_counts() -> None:
    rows = [[9, 9, 4, 9, 9], [9, 9, math.inf, 9, 9], [0, 0, 0, 0, 0]]
    found = DepthToScan(scan_height=3).ranges(image(rows), view_of(camera(), 5))
    assert found[2] == 4.0
    alone = [[math.nan] * 5, [math.inf] * 5, [math.nan] * 5]
    assert DepthToScan().ranges(image(alone), view_of(camera(), 5))[2] == math.inf


def test_depths_of_16_bits_are_millimetres() -> None:
    found = DepthToScan(range_max=3.0).ranges(
        image([[0] * 5, [0, 0, 2500, 0, 9000], [0] * 5], "16UC1"), view_of(camera(), 5)
    )
    assert found[2] == np.float32(2.5)
    assert np.isnan(found[[0, 1, 3, 4]]).all()


def test_what_cannot_become_a_scan_is_an_error() -> None:
    view = view_of(camera(), 5)
    good = image([[1] * 5] * 3)
    with pytest.raises(InvalidDepthImage, match=r"scan_height \(4 pixels\) is too large"):
        DepthToScan(scan_height=4).ranges(good, view)
    good.encoding = "bgr8"
    with pytest.raises(InvalidDepthImage, match="must be 16UC1 or 32FC1, got bgr8"):
        DepthToScan().ranges(good, view)
    good.encoding, good.data = "32FC1", b""
    with pytest.raises(InvalidDepthImage, match="got 0"):
        DepthToScan().ranges(good, view)
    good.width, good.height, good.step = 2**29, 0, 2**31
    with pytest.raises(InvalidDepthImage, match=r"an image of 536870912 x 0"):
        DepthToScan().ranges(good, replace(view, center_y=0.0))
    with pytest.raises(InvalidDepthImage, match="too large for the image height"):
        DepthToScan().ranges(good, replace(view, center_y=math.nan))
    with pytest.raises(InvalidDepthImage, match="not calibrated"):
        view_of(camera(0.0), 5)
    bent = camera()
    bent.D = [0.1]
    with pytest.raises(InvalidDepthImage, match="number of distortion coefficients"):
        view_of(bent, 5)
