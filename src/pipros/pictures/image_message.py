"""Check `sensor_msgs/Image` messages, and convert them to PNG."""

from __future__ import annotations

from typing import Any

from pipros.basics.printable import printable
from pipros.pictures.encodings import Color, Encoding, UnknownEncoding, shown_encoding
from pipros.pictures.errors import PictureError
from pipros.pictures.png import png

IMAGE_TYPES = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")

_YUV = (Color.YUV422, Color.YUV422_YUY2)


def encoding_of(message: Any) -> Encoding:
    """Return the encoding with which to show an image's pixels.

    Raises:
        PictureError: the encoding is unknown or cannot be shown, or pixels are missing.
    """
    try:
        found = shown_encoding(message.encoding)
    except UnknownEncoding:
        found = None
    if found is None or found.color is None:
        raise PictureError(f"cannot show images with the encoding [{printable(message.encoding)}]")
    width, height, step = message.width, message.height, message.step
    row = width * found.channels * found.bits // 8
    if step < row or len(message.data) < step * height:
        raise PictureError(
            f"{width} x {height} pixels of {message.encoding} need {height} rows of {row} bytes, got "
            f"{len(message.data)} bytes in rows of {step}"
        )
    return found


def image_png(message: Any) -> bytes:
    """Return the contents of a PNG file for an image. Bayer patterns are written in grey.

    Raises:
        PictureError: see `encoding_of`; or PNG does not support the encoding.
    """
    found = encoding_of(message)
    if found.color in _YUV or found.depth not in ("8U", "16U"):
        raise PictureError(
            f"PNG supports only grey and RGB values with 8 or 16 bits, got [{message.encoding}]"
        )
    size = found.bits // 8
    row = message.width * found.channels * size
    rows = []
    for top in range(0, message.height * message.step, message.step or 1):
        line = bytearray(message.data[top : top + row])
        if size == 2 and not message.is_bigendian:
            line[0::2], line[1::2] = line[1::2], line[0::2]
        if found.color in (Color.BGR, Color.BGRA):
            stride = found.channels * size
            for byte in range(size):
                red = byte + 2 * size
                line[byte::stride], line[red::stride] = line[red::stride], line[byte::stride]
        rows.append(line)
    return png(message.width, message.height, found.channels, found.bits, rows)
