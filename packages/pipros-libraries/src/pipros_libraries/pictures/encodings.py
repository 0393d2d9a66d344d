"""The encodings of `sensor_msgs/Image`, with the channels, depth and colours of each."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from enum import Enum


class UnknownEncoding(RuntimeError):
    """An encoding is unknown. The error text is the same as in Noetic, because scripts compare it."""


class Color(Enum):
    """The order of the channels in a pixel, or of the bytes in two pixels (YUV) or four pixels (Bayer)."""

    GRAY = "gray"
    RGB = "rgb"
    BGR = "bgr"
    RGBA = "rgba"
    BGRA = "bgra"
    YUV422 = "uyvy"
    YUV422_YUY2 = "yuyv"
    BAYER_RGGB = "rggb"
    BAYER_BGGR = "bggr"
    BAYER_GBRG = "gbrg"
    BAYER_GRBG = "grbg"


@dataclass(frozen=True, slots=True)
class Encoding:
    """An image encoding.

    Attributes:
        depth: OpenCV's name for the value type: 8U, 8S, 16U, 16S, 32S, 32F or 64F.
        channels: values per pixel, 1 or more.
        color: the order of the channels; None for encodings that do not define colours, such as 8UC3.
    """

    name: str
    depth: str
    channels: int
    color: Color | None = None

    @property
    def bits(self) -> int:
        """Bits per value."""
        return int(self.depth[:-1])

    @property
    def dtype(self) -> str:
        """Name of the numpy dtype of a value."""
        return DTYPES[self.depth]

    @property
    def cv_type(self) -> int:
        """OpenCV's number for the type, such as 16 for CV_8UC3."""
        return list(DTYPES).index(self.depth) + (self.channels - 1) * CHANNEL_STEP


DTYPES = {
    "8U": "uint8",
    "8S": "int8",
    "16U": "uint16",
    "16S": "int16",
    "32S": "int32",
    "32F": "float32",
    "64F": "float64",
}
"""numpy dtypes by OpenCV depth, in the order of OpenCV's depth numbers."""

CHANNEL_STEP = 8
"""Difference between the OpenCV type numbers of n and n + 1 channels."""

_CHANNELS = {Color.GRAY: 1, Color.RGB: 3, Color.BGR: 3, Color.RGBA: 4, Color.BGRA: 4}
_BAYER = (Color.BAYER_RGGB, Color.BAYER_BGGR, Color.BAYER_GBRG, Color.BAYER_GRBG)


def _named() -> dict[str, Encoding]:
    found = [
        Encoding(f"{'mono' if color is Color.GRAY else color.value}{bits}", f"{bits}U", channels, color)
        for bits in (8, 16)
        for color, channels in _CHANNELS.items()
    ]
    found += [
        Encoding(f"bayer_{color.value}{bits}", f"{bits}U", 1, color) for bits in (8, 16) for color in _BAYER
    ]
    found.append(Encoding("yuv422", "8U", 2, Color.YUV422))
    return {encoding.name: encoding for encoding in found}


COLORS = _named()
"""The encodings that define colours, by name."""

_ABSTRACT = re.compile(r"(8[US]|16[US]|32[SF]|64F)(?:C([0-9]+))?")
_MAX_CHANNELS = 512  # OpenCV's limit


def encoding(name: str) -> Encoding:
    """Return an encoding by name: one of `COLORS`, or an OpenCV type such as 32FC1 or 8U.

    Raises:
        UnknownEncoding: the name is unknown.
    """
    if name in COLORS:
        return COLORS[name]
    match = _ABSTRACT.fullmatch(name)
    channels = int(match[2] or 1) if match and len(match[2] or "") <= len(str(_MAX_CHANNELS)) else 0
    if match is None or not 1 <= channels <= _MAX_CHANNELS:
        raise UnknownEncoding(f"Unrecognized image encoding [{name}]")
    return Encoding(name, match[1], channels)


_SHOWN = {1: Color.GRAY, 3: Color.BGR, 4: Color.BGRA}
_ONLY_SHOWN = Encoding("yuv422_yuy2", "8U", 2, Color.YUV422_YUY2)  # cv_bridge does not know this encoding


def shown_encoding(name: str) -> Encoding:
    """Return the encoding used to show an image on the web page and in saved pictures.

    Types that do not define colours, such as 8UC3, are shown in the order of OpenCV's arrays: grey, BGR or
    BGRA. Conversions of `cv_bridge` treat these types as having no colours, as in Noetic.

    Raises:
        UnknownEncoding: the name is unknown.
    """
    if name == _ONLY_SHOWN.name:
        return _ONLY_SHOWN
    found = encoding(name)
    return found if found.color else replace(found, color=_SHOWN.get(found.channels))
