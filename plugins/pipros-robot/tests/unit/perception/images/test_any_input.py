"""Every message results in an array, or in the documented error."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros_libraries.pictures.encodings import COLORS, DTYPES
from pipros_robot.perception.images.arrays import array_of
from pipros_robot.perception.images.bayer import colors, gray
from pipros_robot.perception.images.clouds import cloud_message, empty_points, set_colors
from pipros_robot.perception.images.depths import set_points
from pipros_robot.perception.images.pinhole import Pinhole, Rectifier
from tests.support.pictures_of_cameras import camera_info

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
