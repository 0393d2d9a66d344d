"""The encodings of `sensor_msgs/Image`: channels and depths by name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum


class UnknownEncoding(RuntimeError):
    """No encoding of `sensor_msgs/Image` has this name. The text is genuine's, which scripts compare."""


class Color(Enum):
    """How the channels of an image form a colour. Images can be converted from one to another."""

    GRAY = "gray"
    RGB = "rgb"
    BGR = "bgr"
    RGBA = "rgba"
    BGRA = "bgra"
    YUV422 = "yuv422"
    BAYER_RGGB = "rggb"
    BAYER_BGGR = "bggr"
    BAYER_GBRG = "gbrg"
    BAYER_GRBG = "grbg"


@dataclass(frozen=True, slots=True)
class Encoding:
    """An encoding by its name.

    Attributes:
        depth: the type of a value as OpenCV writes it: 8U, 8S, 16U, 16S, 32S, 32F or 64F.
        channels: values per pixel, 1 or more.
        color: None for encodings that do not define colours, such as 8UC3.
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
        """The name of numpy's type for a value."""
        return DTYPES[self.depth]

    @property
    def cv_type(self) -> int:
        """The number that OpenCV gives to the type, such as 16 for CV_8UC3."""
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
"""numpy's names of OpenCV's depths, in the order of OpenCV's numbers."""

CHANNEL_STEP = 8
"""How much each further channel adds to the number of an OpenCV type."""

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
_MOST_CHANNELS = 512  # OpenCV's limit


def encoding(name: str) -> Encoding:
    """The encoding of this name: one of `COLORS`, or a type of OpenCV such as 32FC1 or 8U.

    Raises:
        UnknownEncoding: no encoding has this name.
    """
    if name in COLORS:
        return COLORS[name]
    match = _ABSTRACT.fullmatch(name)
    channels = int(match[2] or 1) if match and len(match[2] or "") <= len(str(_MOST_CHANNELS)) else 0
    if match is None or not 1 <= channels <= _MOST_CHANNELS:
        raise UnknownEncoding(f"Unrecognized image encoding [{name}]")
    return Encoding(name, match[1], channels)
