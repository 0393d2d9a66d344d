"""Convert between raw and compressed image messages.

An image that cannot be converted is dropped, and an error is logged.
"""

from __future__ import annotations

from collections.abc import Callable

from sensor_msgs.msg import CompressedImage, Image

import rospy
from cv_bridge import CvBridge, CvBridgeError
from pipros.libraries.vision.compressed_images import (
    CompressionError,
    CompressionSettings,
    compressed,
    decompressed,
)
from pipros.pictures.codecs import codec


def compressor(topic: str) -> Callable[[Image], CompressedImage | None]:
    """Return a function that compresses images according to the parameters of `topic`.

    The parameters are `format`, `jpeg_quality` and `png_level` in the namespace of the topic. The function
    returns None if an image cannot be compressed.

    Raises:
        ImportError: neither OpenCV nor Pillow is installed.
        CompressionError: a parameter has an invalid value.
    """
    default, bridge, pictures = CompressionSettings(), CvBridge(), codec()
    settings = CompressionSettings(
        rospy.get_param(f"{topic}/format", default.kind),
        rospy.get_param(f"{topic}/jpeg_quality", default.jpeg_quality),
        rospy.get_param(f"{topic}/png_level", default.png_level),
    )

    def compress(message: Image) -> CompressedImage | None:
        try:
            array = bridge.imgmsg_to_cv2(message)
            kind, data = compressed(array, message.encoding, settings, pictures)
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
