"""Writes PNG files of whole images.

Written by hand: `rosbag export` needs no more than this, and Pillow, which would do it, is a wheel of 7 MB
that takes 21 ms to import, and has no colours of 16 bits.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable

_COLOUR_TYPES = {1: 0, 3: 2, 4: 6}
"""PNG's numbers of grey, RGB and RGBA, by channels."""


def png(width: int, height: int, channels: int, bits: int, rows: Iterable[bytes | bytearray]) -> bytes:
    """Return a PNG file.

    Args:
        channels: 1 for grey, 3 for RGB, 4 for RGBA.
        bits: 8, or 16 with the more significant byte first.
    """
    head = struct.pack(">IIBBBBB", width, height, bits, _COLOUR_TYPES[channels], 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows), 6)
    parts = (_part(b"IHDR", head), _part(b"IDAT", pixels), _part(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _part(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
