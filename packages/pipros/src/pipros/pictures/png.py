"""Encode complete images as PNG.

Pillow is not used, because it is a 7 MB wheel, takes 21 ms to import, and does not support 16-bit colours.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable

_COLOUR_TYPES = {1: 0, 3: 2, 4: 6}
"""PNG's colour type numbers for grey, RGB and RGBA, keyed by number of channels."""


def png(
    width: int, height: int, channels: int, bits: int, rows: Iterable[bytes | bytearray], level: int = 6
) -> bytes:
    """Return the contents of a PNG file.

    Args:
        channels: 1 for grey, 3 for RGB, 4 for RGBA.
        bits: bits per value: 8, or 16 with the more significant byte first.
        rows: the bytes of each row, from top to bottom, without padding.
        level: zlib's compression level, 1 (fastest) to 9.
    """
    head = struct.pack(">IIBBBBB", width, height, bits, _COLOUR_TYPES[channels], 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows), level)
    parts = (_part(b"IHDR", head), _part(b"IDAT", pixels), _part(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _part(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
