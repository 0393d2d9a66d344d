"""Names and properties of the encodings of `sensor_msgs/Image`, as in the C++ header `image_encodings.h`.

Genuine sensor_msgs has no such Python module. Scripts that must also run with genuine ROS cannot import it.
"""

from __future__ import annotations

from pipros_libraries.pictures import encodings as _encodings

RGB8, RGBA8, RGB16, RGBA16 = "rgb8", "rgba8", "rgb16", "rgba16"
BGR8, BGRA8, BGR16, BGRA16 = "bgr8", "bgra8", "bgr16", "bgra16"
MONO8, MONO16 = "mono8", "mono16"

TYPE_8UC1, TYPE_8UC2, TYPE_8UC3, TYPE_8UC4 = "8UC1", "8UC2", "8UC3", "8UC4"
TYPE_8SC1, TYPE_8SC2, TYPE_8SC3, TYPE_8SC4 = "8SC1", "8SC2", "8SC3", "8SC4"
TYPE_16UC1, TYPE_16UC2, TYPE_16UC3, TYPE_16UC4 = "16UC1", "16UC2", "16UC3", "16UC4"
TYPE_16SC1, TYPE_16SC2, TYPE_16SC3, TYPE_16SC4 = "16SC1", "16SC2", "16SC3", "16SC4"
TYPE_32SC1, TYPE_32SC2, TYPE_32SC3, TYPE_32SC4 = "32SC1", "32SC2", "32SC3", "32SC4"
TYPE_32FC1, TYPE_32FC2, TYPE_32FC3, TYPE_32FC4 = "32FC1", "32FC2", "32FC3", "32FC4"
TYPE_64FC1, TYPE_64FC2, TYPE_64FC3, TYPE_64FC4 = "64FC1", "64FC2", "64FC3", "64FC4"

BAYER_RGGB8, BAYER_BGGR8, BAYER_GBRG8, BAYER_GRBG8 = (
    "bayer_rggb8",
    "bayer_bggr8",
    "bayer_gbrg8",
    "bayer_grbg8",
)
BAYER_RGGB16, BAYER_BGGR16 = "bayer_rggb16", "bayer_bggr16"
BAYER_GBRG16, BAYER_GRBG16 = "bayer_gbrg16", "bayer_grbg16"

YUV422 = "yuv422"

_WITH_COLORS = RGB8, RGBA8, RGB16, RGBA16, BGR8, BGRA8, BGR16, BGRA16


def isColor(encoding: str) -> bool:
    """Return True for the RGB and BGR encodings, with or without alpha."""
    return encoding in _WITH_COLORS


def isMono(encoding: str) -> bool:
    """Return True for `mono8` and `mono16`."""
    return encoding in (MONO8, MONO16)


def isBayer(encoding: str) -> bool:
    """Return True for the Bayer encodings."""
    return encoding.startswith("bayer_") and encoding in _encodings.COLORS


def hasAlpha(encoding: str) -> bool:
    """Return True for the RGB and BGR encodings with an alpha channel."""
    return encoding in (RGBA8, BGRA8, RGBA16, BGRA16)


def numChannels(encoding: str) -> int:
    """Return the number of values per pixel.

    Raises:
        RuntimeError: the encoding is unknown.
    """
    return _known(encoding).channels


def bitDepth(encoding: str) -> int:
    """Return the number of bits per value.

    Raises:
        RuntimeError: the encoding is unknown.
    """
    return _known(encoding).bits


def _known(name: str) -> _encodings.Encoding:
    try:
        return _encodings.encoding(name)
    except RuntimeError:
        raise RuntimeError(f"Unknown encoding {name}") from None
