"""The size of a compressed image, from its header."""

from __future__ import annotations

import math
import struct
from typing import Final

PNG: Final = b"\x89PNG\r\n\x1a\n"
_START_OF_FRAME: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Markers of the JPEG segments that contain the size of the image."""
_JPEG_2000: Final = b"\xff\x4f\xff\x51"
"""Start of a JPEG 2000 codestream, up to the marker of the segment that contains its size."""


def pixel_count(picture: bytes) -> int | None:
    """Return the number of pixels that the header of an image gives, or 0 if the header is damaged.

    Return None for formats other than JPEG, PNG, TIFF, BMP, WebP and JPEG 2000.
    """
    try:
        if picture.startswith(PNG):
            return _product(">II", picture, 16)
        if picture.startswith((b"II*\0", b"MM\0*")):
            return _tiff_pixel_count(picture, "<" if picture.startswith(b"II") else ">")
        if picture.startswith(b"BM"):
            return abs(_product("<HH" if picture[14] == 12 else "<ii", picture, 18))
        if picture.startswith(b"RIFF") and picture[8:12] == b"WEBP":
            return _webp_pixel_count(picture)
        if picture.startswith((_JPEG_2000, b"\0\0\0\x0cjP  ")):
            right, bottom, left, top = struct.unpack_from(">4I", picture, picture.index(_JPEG_2000) + 8)
            return (int(right) - int(left)) * (int(bottom) - int(top))
        if not picture.startswith(b"\xff\xd8"):
            return None
        at = 2
        while picture[at + 1] not in _START_OF_FRAME:  # a segment begins with 0xff, a marker and its size
            after = 1 if picture[at + 1] == 0xFF else 2 + int.from_bytes(picture[at + 2 : at + 4], "big")
            at = picture.index(b"\xff", at + after)
        return _product(">HH", picture, at + 5)
    except (IndexError, ValueError, struct.error):
        return 0


def _product(layout: str, picture: bytes, at: int) -> int:
    return int(math.prod(struct.unpack_from(layout, picture, at)))


def _webp_pixel_count(picture: bytes) -> int:
    kind = picture[12:16]
    if kind == b"VP8X":  # each side minus 1, in 24 bits
        return (int.from_bytes(picture[24:27], "little") + 1) * (int.from_bytes(picture[27:30], "little") + 1)
    at = 21 if kind == b"VP8L" else 26
    sides = int.from_bytes(picture[at : at + 4], "little")
    if len(picture) < at + 4:
        return 0
    if kind == b"VP8L":  # each side minus 1, in 14 bits
        return ((sides & 0x3FFF) + 1) * ((sides >> 14 & 0x3FFF) + 1)
    return (sides & 0x3FFF) * (sides >> 16 & 0x3FFF)


def _tiff_pixel_count(picture: bytes, order: str) -> int:
    [start] = struct.unpack_from(f"{order}I", picture, 4)
    [entries] = struct.unpack_from(f"{order}H", picture, start)
    sides = {}
    for at in range(start + 2, start + 2 + 12 * entries, 12):
        tag, kind = struct.unpack_from(f"{order}HH", picture, at)
        [sides[tag]] = struct.unpack_from(order + ("H" if kind == 3 else "I"), picture, at + 8)
    return int(sides.get(256, 0) * sides.get(257, 0))
