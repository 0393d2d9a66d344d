"""Save `sensor_msgs` images as files: raw images as PNG, without a library; compressed images unchanged."""

from __future__ import annotations

import struct
import zlib
from typing import Any

from pipros.bag.errors import BagError
from pipros.msg.class_finder import installed_class

# For each encoding: bytes per sample, samples per pixel, PNG's colour type, the order of the samples.
_ENCODINGS = {
    "mono8": (1, 1, 0, "k"), "8UC1": (1, 1, 0, "k"), "mono16": (2, 1, 0, "k"), "16UC1": (2, 1, 0, "k"),
    "rgb8": (1, 3, 2, "rgb"), "8UC3": (1, 3, 2, "bgr"), "bgr8": (1, 3, 2, "bgr"),
    "rgba8": (1, 4, 6, "rgba"), "bgra8": (1, 4, 6, "bgra"), "8UC4": (1, 4, 6, "bgra"),
    "bayer_rggb8": (1, 1, 0, "k"), "bayer_bggr8": (1, 1, 0, "k"), "bayer_gbrg8": (1, 1, 0, "k"),
    "bayer_grbg8": (1, 1, 0, "k"),
}  # fmt: skip
IMAGE_TYPES = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")


def image_file(message: Any) -> tuple[str, bytes]:
    """Return the suffix and the content of the image file.

    Raises:
        BagError: the encoding is not supported, the image has fewer bytes than its size requires, or its
            definition differs from the installed one.
    """
    installed = installed_class(message._type)
    if installed is None or installed._md5sum != message._md5sum:
        raise BagError(f"the definition of [{message._type}] must be the installed one")
    if message._type == "sensor_msgs/CompressedImage":
        data = bytes(message.data)
        return (".png" if data.startswith(b"\x89PNG") else ".jpg"), data
    known = _ENCODINGS.get(message.encoding)
    if known is None:
        raise BagError(f"image encoding must be one of {', '.join(_ENCODINGS)}, got [{message.encoding}]")
    size, samples, colour, order = known
    width, height, step = message.width, message.height, message.step
    row = width * size * samples
    if step < row or len(message.data) < step * height:
        raise BagError(
            f"an image of {width} x {height} must have {row * height} bytes, got {len(message.data)} in "
            f"rows of {step}"
        )
    rows = bytearray()
    for number in range(height):
        line = bytearray(message.data[number * step : number * step + row])
        if size == 2 and not message.is_bigendian:
            line[0::2], line[1::2] = line[1::2], line[0::2]
        if order.startswith("bgr"):
            line[0::samples], line[2::samples] = line[2::samples], line[0::samples]
        rows += b"\0" + line
    head = struct.pack(">IIBBBBB", width, height, 8 * size, colour, 0, 0, 0)
    parts = (_part(b"IHDR", head), _part(b"IDAT", zlib.compress(rows, 6)), _part(b"IEND", b""))
    return ".png", b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _part(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
