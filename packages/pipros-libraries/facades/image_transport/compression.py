"""Convert between raw and compressed image messages.

An image that cannot be converted is dropped, and an error is logged.
"""

from __future__ import annotations

from collections.abc import Callable

from sensor_msgs.msg import CompressedImage, Image

import rospy
from cv_bridge import CvBridge, CvBridgeError
from pipros_libraries.pictures.codecs import codec
from pipros_libraries.vision.compressed_images import (
    CompressionError,
    compressed_by,
    decompressed,
    read_settings,
)


def compressor(topic: str) -> Callable[[Image], CompressedImage | None]:
    """Return a function that compresses images according to the parameters of `topic`.

    The last component of the topic is the transport. The parameters are in the topic's namespace: `format`,
    `png_level`, `jpeg_quality`, or `depth_max` and `depth_quantization`. The function returns None if an
    image cannot be compressed.

    Raises:
        ImportError: neither OpenCV nor Pillow is installed.
        CompressionError: a parameter has an invalid value.
    """
    bridge, pictures = CvBridge(), codec()
    settings = read_settings(
        topic.rpartition("/")[2], lambda name, default: rospy.get_param(f"{topic}/{name}", default)
    )

    def compress(message: Image) -> CompressedImage | None:
        try:
            array = bridge.imgmsg_to_cv2(message)
            kind, data = compressed_by(settings, array, message.encoding, pictures)
        except (CvBridgeError, CompressionError) as error:
            rospy.logerr_throttle(10, f"cannot compress image: {error}")
            return None
        return CompressedImage(message.header, kind, data)

    return compress


def decompressor() -> Callable[[CompressedImage], Image | None]:
    """Return a function that decompresses images, and returns None for images that cannot be decompressed.

    Raises:
        ImportError: neither OpenCV nor Pillow is installed.
    """
    bridge, pictures = CvBridge(), codec()

    def decompress(message: CompressedImage) -> Image | None:
        try:
            array, encoding = decompressed(message.format, message.data, pictures)
            image: Image = bridge.cv2_to_imgmsg(array, encoding, message.header)
        except (CvBridgeError, CompressionError) as error:
            rospy.logerr_throttle(10, f"cannot decompress image: {error}")
            return None
        return image

    return decompress
