"""Encode image messages for browsers, which convert the pixels and decode compressed images."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pipros.basics.printable import printable
from pipros_libraries.pictures.compressed import DEPTH_HEADER
from pipros_libraries.pictures.encodings import Color
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.headers import PNG
from pipros_libraries.pictures.image_message import encoding_of
from pipros_page.messages.known_topic import LONGEST_NAME
from pipros_server.view_server import RequestRefused

LARGEST_BYTES = 2_000_000
"""Size in bytes above which raw images are subsampled to every second, third, … row and column."""


def packed(message: Any, largest_bytes: int = LARGEST_BYTES) -> tuple[Mapping[str, Any], bytes]:
    """Encode a `sensor_msgs/Image` or `CompressedImage` for the browser. Return a header and the pixels.

    Raises:
        RequestRefused: the page cannot show the encoding, pixels are missing, or a compressed depth image is
            malformed.
    """
    if message._type == "sensor_msgs/CompressedImage":
        return _compressed(message)
    try:
        encoding = encoding_of(message)
    except PictureError as error:
        raise RequestRefused(str(error)) from None
    is_grey = encoding.color is Color.GRAY
    if encoding.depth not in ("8U", "16U") and not is_grey:
        raise RequestRefused(f"the page cannot show images with the encoding [{message.encoding}]")
    width, height, step = message.width, message.height, message.step
    depth, size, plane = encoding.depth, encoding.channels * encoding.bits // 8, slice(None)
    row = width * size
    if depth == "16U" and not is_grey:  # screens have 8 bits per colour, so use the more significant byte
        depth, size, plane = "8U", size // 2, slice(0 if message.is_bigendian else 1, None, 2)
    every = _step(message.encoding, width * height * size, largest_bytes)
    data = memoryview(message.data)
    tops = range(0, height * step, step * every) if width else ()
    pixels = b"".join(_thinned(data[top : top + row][plane], size, every) for top in tops)
    head = {
        "encoding": message.encoding,
        "color": encoding.color and encoding.color.value,
        "depth": depth,
        "big": bool(message.is_bigendian),
        "width": len(range(0, width, every)),
        "height": len(range(0, height, every)),
        "full": [width, height],
        "frame": message.header.frame_id[:LONGEST_NAME],
    }
    return head, pixels


def _compressed(message: Any) -> tuple[Mapping[str, Any], bytes]:
    """Return data that the browser decodes: PNG or JPEG, or a depth image as PNG with its quantisation."""
    name, _, how = message.format[:LONGEST_NAME].partition(";")
    data = bytes(message.data)
    head = {"compressed": "png" if "png" in how.lower() or "png" in name.lower() else "jpeg"}
    if "compressedDepth" not in how:
        return {**head, "format": message.format[:LONGEST_NAME]}, data
    if len(data) < DEPTH_HEADER.size or name not in ("16UC1", "32FC1"):
        rule = f"must be 16UC1 or 32FC1 with at least {DEPTH_HEADER.size} bytes"
        found = f"[{printable(name)}] with {len(data)} bytes"
        raise RequestRefused(f"a compressed depth image {rule}, got {found}")
    if not data.startswith(PNG, DEPTH_HEADER.size):
        raise RequestRefused("the page can only show compressed depth images in PNG format, not RVL")
    _, quotient, offset = DEPTH_HEADER.unpack_from(data)
    values = {"encoding": name, "quantised": [quotient, offset] if name == "32FC1" else None}
    if not math.isfinite(quotient) or not math.isfinite(offset):
        raise RequestRefused("the depth quantisation of a compressed depth image must be finite")
    return {"compressed": "depth", **values}, data[DEPTH_HEADER.size :]


def _step(encoding: str, size: int, largest_bytes: int) -> int:
    if encoding.startswith(("bayer", "yuv")):  # neighbouring pixels share colour data, so none can be skipped
        return 1
    every = 1
    while size // every**2 > largest_bytes:
        every += 1
    return every


def _thinned(row: memoryview, size: int, every: int) -> bytes:
    if every == 1:
        return bytes(row)
    if size == 1:
        return bytes(row[::every])
    return b"".join(row[left : left + size] for left in range(0, len(row), size * every))
