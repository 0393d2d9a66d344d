"""Create organised point clouds, which have one point per pixel, optionally with colours."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Final

from pipros.msg import load_message_class
from pipros_libraries.vision.conversions import ImageConversionError, convert
from pipros_libraries.vision.extras import numpy as np
from pipros_robot.perception.images.arrays import BadImage

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2, PointField
    from std_msgs.msg import Header

    from pipros_libraries.vision.extras import Array

FLOAT32: Final = 7
"""PointField.FLOAT32."""

_RGB_AT = 4
"""Index of the packed colour in a point's floats."""


def empty_points(height: int, width: int, *, has_colors: bool) -> Array:
    """Return a float32 array of zeros for a cloud, with 4 floats per point, or 8 if it has colours.

    The shape is (height, width, floats). The first three floats of a point are x, y and z.
    """
    return np.zeros((height, width, 8 if has_colors else 4), np.float32)


def set_colors(points: Array, image: Array, name: str, alpha: int) -> None:
    """Set the packed colours of points. Their bytes in memory are blue, green, red and alpha.

    Args:
        image: an image with the height and width of `points`, in any colour or grey encoding.

    Raises:
        BadImage: the encoding is neither a colour nor a grey encoding.
    """
    packed = points[:, :, _RGB_AT : _RGB_AT + 1].view(np.uint8)
    try:
        bgr = image if name in ("bgr8", "bgra8") else convert(image, name, "bgr8")
    except ImageConversionError as error:
        raise BadImage(str(error)) from error
    packed[:, :, :3] = bgr[:, :, :3]
    packed[:, :, 3] = alpha


def cloud_message(points: Array, header: Header) -> PointCloud2:
    """Return a `sensor_msgs/PointCloud2` sharing the memory of `points`, which must not be changed later."""
    field: type[PointField] = load_message_class("sensor_msgs/PointField")
    message: PointCloud2 = load_message_class("sensor_msgs/PointCloud2")()
    height, width, floats = points.shape
    message.header = copy.copy(header)  # publishing sets its seq
    message.height, message.width = height, width
    message.fields = [field(name, 4 * at, FLOAT32, 1) for at, name in enumerate("xyz")]
    if floats > _RGB_AT:
        message.fields.append(field("rgb", 4 * _RGB_AT, FLOAT32, 1))
    message.point_step = 4 * floats
    message.row_step = message.point_step * width
    message.data = points.reshape(-1).view(np.uint8)
    return message
