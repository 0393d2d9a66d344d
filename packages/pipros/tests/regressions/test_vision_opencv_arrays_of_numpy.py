"""vision_opencv: views, transposed and big-endian arrays, or one channel, gave scrambled images."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import cv_bridge

WHOLE: Any = np.arange(96, dtype=np.uint8).reshape(4, 8, 3)


@pytest.mark.parametrize(
    ("array", "encoding"),
    [
        (WHOLE[:, ::2], "bgr8"),
        (WHOLE[::-1], "bgr8"),
        (WHOLE[..., ::-1], "rgb8"),
        (WHOLE[1:3, 2:5], "bgr8"),
        (np.asfortranarray(WHOLE), "bgr8"),
        (WHOLE.transpose(1, 0, 2), "bgr8"),
        (WHOLE[..., 0], "mono8"),
        (WHOLE[..., :1], "mono8"),
        (WHOLE[..., 0].astype(">u2"), "mono16"),
        (WHOLE[..., 0].astype("f4"), "32FC1"),
        (WHOLE[:0], "bgr8"),
    ],
)
def test_an_array_arrives_as_it_was(array: Any, encoding: str) -> None:
    bridge = cv_bridge.CvBridge()
    message = bridge.cv2_to_imgmsg(array, encoding)
    assert (message.height, message.width) == array.shape[:2]
    found = bridge.imgmsg_to_cv2(message)
    assert np.array_equal(found, array.reshape(found.shape))
    assert (found.dtype.kind, found.dtype.itemsize) == (array.dtype.kind, array.dtype.itemsize)
