"""The size of a compressed image, from its header."""

from __future__ import annotations

import math
import struct
from typing import Final

PNG: Final = b"\x89PNG\r\n\x1a\n"
_START_OF_FRAME: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Markers of the JPEG segments that contain the size of the image."""


def pixel_count(picture: bytes) -> int:
    """Return the number of pixels that the header of a PNG, JPEG or TIFF image gives, or 0 if it has none."""
    try:
        if picture.startswith(PNG):
            return math.prod(struct.unpack_from(">II", picture, 16))
        if picture.startswith((b"II*\0", b"MM\0*")):
            return _tiff_pixel_count(picture, "<" if picture.startswith(b"II") else ">")
        at = 2 if picture.startswith(b"\xff\xd8") else len(picture)
        while picture[at + 1] not in _START_OF_FRAME:  # a segment begins with 0xff, a marker and its size
            after = 1 if picture[at + 1] == 0xFF else 2 + int.from_bytes(picture[at + 2 : at + 4], "big")
            at = picture.index(b"\xff", at + after)
        return math.prod(struct.unpack_from(">HH", picture, at + 5))
    except (IndexError, ValueError, struct.error):
        return 0


def _tiff_pixel_count(picture: bytes, order: str) -> int:
    [start] = struct.unpack_from(f"{order}I", picture, 4)
    [entries] = struct.unpack_from(f"{order}H", picture, start)
    sides = {}
    for at in range(start + 2, start + 2 + 12 * entries, 12):
        tag, kind = struct.unpack_from(f"{order}HH", picture, at)
        [sides[tag]] = struct.unpack_from(order + ("H" if kind == 3 else "I"), picture, at + 8)
    return int(sides.get(256, 0) * sides.get(257, 0))
