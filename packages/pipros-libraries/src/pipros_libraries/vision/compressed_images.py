"""Create and decode `sensor_msgs/CompressedImage` messages in the format of compressed_image_transport.

The field `format` contains the image's encoding and the channel order of the compressed data, for example
`rgb8; jpeg compressed bgr8`. The data of depth images from compressed_depth_image_transport start with a
12-byte header: an int32, and two float32 values that define the quantisation of depths to 16 bits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

from pipros.basics.errors import PiprosError
from pipros_libraries.pictures.codecs import Codec
from pipros_libraries.pictures.compressed import DEPTH_HEADER, pixels_of
from pipros_libraries.pictures.encodings import COLORS, Color, encoding
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.vision.conversions import convert
from pipros_libraries.vision.extras import numpy as np

_HAS_COLORS = (Color.RGB, Color.BGR, Color.RGBA, Color.BGRA)
_JPEG_TO_16_BITS = 256
_WHITE = 65535


class CompressionError(PiprosError, ValueError):
    """An image cannot be compressed or decompressed."""


@dataclass(frozen=True, slots=True)
class CompressionSettings:
    """Compression settings.

    Attributes:
        kind: `jpeg` or `png`.
        jpeg_quality: from 1 to 100.
        png_level: from 1 (fast) to 9 (small).

    Raises:
        CompressionError: a value is invalid.
    """

    kind: str = "jpeg"
    jpeg_quality: int = 80
    png_level: int = 9

    def __post_init__(self) -> None:
        if self.kind not in ("jpeg", "png"):
            raise CompressionError(f"the format of compressed images must be jpeg or png, got {self.kind!r}")
        for name, value, limit in (
            ("jpeg_quality", self.jpeg_quality, 100),
            ("png_level", self.png_level, 9),
        ):
            if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= limit:
                raise CompressionError(f"{name} must be an integer from 1 to {limit}, got {value!r}")


def compressed(
    image: Any, encoding_name: str, settings: CompressionSettings, codec: Codec
) -> tuple[str, bytes]:
    """Compress an image array. Return the format and the data of a CompressedImage.

    Raises:
        CompressionError: the encoding is unknown, does not have 8 or 16 bits per value, or is not supported
            by the codec.
    """
    try:
        bits = encoding(encoding_name).bits
        if bits not in (8, 16):
            raise CompressionError(f"{settings.kind} requires 8-bit or 16-bit values, got [{encoding_name}]")
        target = ""
        if encoding_name in COLORS and COLORS[encoding_name].color in _HAS_COLORS:
            target = "bgr8" if settings.kind == "jpeg" else f"bgr{bits}"
            image = convert(image, encoding_name, target)
        elif settings.kind == "jpeg" and bits == 16:
            image = (image // _JPEG_TO_16_BITS).astype(np.uint8)
        level = settings.jpeg_quality if settings.kind == "jpeg" else settings.png_level
        data = codec.encode(image, settings.kind, level)
    except (PictureError, RuntimeError) as error:
        raise CompressionError(str(error)) from error
    return f"{encoding_name}; {settings.kind} compressed {target}", data


@dataclass(frozen=True, slots=True)
class DepthSettings:
    """Settings of compressedDepth.

    Attributes:
        kind: `png`, the only supported format.
        depth_max: maximum depth in metres, from 1 to 100. Greater depths are lost.
        depth_quantization: depth in metres, from 1 to 150, at which 32-bit depths would have a resolution of
            about 1 m. The resolution is proportional to the square of the depth.
        png_level: from 1 (fast) to 9 (small).

    Raises:
        CompressionError: a value is invalid.
    """

    kind: str = "png"
    depth_max: float = 10.0
    depth_quantization: float = 100.0
    png_level: int = 1

    def __post_init__(self) -> None:
        if self.kind != "png":
            raise CompressionError(f"the format of compressed depths must be png, got {self.kind!r}")
        for name, value, limit in (
            ("depth_max", self.depth_max, 100),
            ("depth_quantization", self.depth_quantization, 150),
            ("png_level", self.png_level, 9),
        ):
            if isinstance(value, bool) or not isinstance(value, int | float) or not 1 <= value <= limit:
                raise CompressionError(f"{name} must be a number from 1 to {limit}, got {value!r}")


def read_settings(transport: str, get: Callable[[str, Any], Any]) -> CompressionSettings | DepthSettings:
    """Return the settings of the transport `compressed` or `compressedDepth`.

    `get` returns a parameter's value, or the given default. Raises CompressionError if a value is invalid.
    """
    kind = DepthSettings if transport == "compressedDepth" else CompressionSettings
    default = kind()
    names = {each.name: "format" if each.name == "kind" else each.name for each in fields(kind)}
    return kind(**{field: get(name, getattr(default, field)) for field, name in names.items()})


def compressed_by(
    settings: CompressionSettings | DepthSettings, image: Any, encoding_name: str, codec: Codec
) -> tuple[str, bytes]:
    """Compress an image array with the given settings; see `compressed` and `compressed_depth`."""
    compress: Any = compressed_depth if isinstance(settings, DepthSettings) else compressed
    result: tuple[str, bytes] = compress(image, encoding_name, settings, codec)
    return result


def compressed_depth(
    image: Any, encoding_name: str, settings: DepthSettings, codec: Codec
) -> tuple[str, bytes]:
    """Compress a depth image. Return the format and the data of a CompressedImage.

    16-bit depths (in millimetres) are stored exactly. For 32FC1 depths (in metres), the inverse is quantised,
    so small depths are more accurate. Depths beyond `depth_max` are lost, and so are 32FC1 depths too small
    for 16 bits (by default, below about 0.15 m).

    Raises:
        UnknownEncoding: the encoding is unknown.
        CompressionError: the encoding does not have a single channel of 16-bit integers or 32-bit floats.
    """
    kind = encoding(encoding_name)
    if kind.channels != 1 or kind.depth not in ("16U", "32F"):
        raise CompressionError(f"depths must be 16UC1 or 32FC1, got [{encoding_name}]")
    quotient = offset = 0.0
    if kind.depth == "16U":
        steps = np.where(image > settings.depth_max * 1000, np.uint16(0), image)
    else:
        quotient = settings.depth_quantization * (settings.depth_quantization + 1)
        offset = 1 - quotient / settings.depth_max
        with np.errstate(divide="ignore", invalid="ignore"):
            coded = np.float32(quotient) / image + np.float32(offset)
        is_near = (image < settings.depth_max) & (coded > 0) & (coded < _WHITE + 1)
        steps = np.where(is_near, coded, 0).astype(np.uint16)
    try:
        data = codec.encode(steps, "png", settings.png_level)
    except PictureError as error:
        raise CompressionError(str(error)) from error
    return f"{encoding_name}; compressedDepth png", DEPTH_HEADER.pack(0, quotient, offset) + data


def decompressed(format_text: str, data: bytes, codec: Codec) -> tuple[Any, str]:
    """Decompress a CompressedImage. Return the image array and its encoding.

    Raises:
        CompressionError: the data is not a valid image, or does not match the format.
    """
    name, semicolon, how = format_text.partition(";")
    try:
        if "compressedDepth" in how:
            return pixels_of(format_text, data, codec), name
        image = codec.decode(data)
        if not semicolon:
            # The format does not contain an encoding, so use the encoding of the decoded image.
            return image, _encoding_of_picture(image)
        if "jpeg" in how and encoding(name).bits == 16 and image.dtype == np.uint8:
            image = image.astype(np.uint16) * _JPEG_TO_16_BITS
        color = COLORS[name].color if name in COLORS else None
        if color in _HAS_COLORS or (color is Color.GRAY and image.ndim == 3):
            actual = _encoding_of_picture(image)
            if color in _HAS_COLORS and "compressed bgr" not in how:
                actual = actual.replace("bgr", "rgb")
            image = convert(image, actual, name)
    except (PictureError, RuntimeError) as error:
        raise CompressionError(str(error)) from error
    return image, name


def _encoding_of_picture(image: Any) -> str:
    names = {1: "mono", 3: "bgr", 4: "bgra"}
    return f"{names[image.shape[2] if image.ndim == 3 else 1]}{image.dtype.itemsize * 8}"
