"""Organised point clouds: one point per pixel, optionally with colours."""

from __future__ import annotations

import copy
from typing import Any, Final

from pipros.libraries.images.arrays import BadImage
from pipros.libraries.vision.conversions import ImageConversionError, convert
from pipros.libraries.vision.extras import numpy as np
from pipros.msg import load_message_class

FLOAT32: Final = 7
"""PointField.FLOAT32."""

_RGB_AT = 4
"""Index of the packed colour among the floats of a point."""


def empty_points(height: int, width: int, *, has_colors: bool) -> Any:
    """Return the memory of a cloud as floats, of shape (height, width, 4) or, with colours, (…, 8).

    The first three floats are x, y and z. All are 0.
    """
    return np.zeros((height, width, 8 if has_colors else 4), np.float32)


def set_colors(points: Any, image: Any, name: str, alpha: int) -> None:
    """Set the packed colours of points: in memory blue, green, red, alpha.

    Args:
        image: an image with as many pixels as there are points, of any encoding with colours or grey.

    Raises:
        BadImage: the encoding has neither colours nor grey.
    """
    packed = points[:, :, _RGB_AT : _RGB_AT + 1].view(np.uint8)
    try:
        bgr = image if name in ("bgr8", "bgra8") else convert(image, name, "bgr8")
    except ImageConversionError as error:
        raise BadImage(str(error)) from error
    packed[:, :, :3] = bgr[:, :, :3]
    packed[:, :, 3] = alpha


def cloud_message(points: Any, header: Any) -> Any:
    """Return a `sensor_msgs/PointCloud2` with the memory of `points`, which must not change afterwards."""
    field: Any = load_message_class("sensor_msgs/PointField")
    message: Any = load_message_class("sensor_msgs/PointCloud2")()
    height, width, floats = points.shape
    message.header = copy.copy(header)  # publishing numbers it
    message.height, message.width = height, width
    message.fields = [field(name, 4 * at, FLOAT32, 1) for at, name in enumerate("xyz")]
    if floats > _RGB_AT:
        message.fields.append(field("rgb", 4 * _RGB_AT, FLOAT32, 1))
    message.point_step = 4 * floats
    message.row_step = message.point_step * width
    message.data = points.reshape(-1).view(np.uint8)
    return message
