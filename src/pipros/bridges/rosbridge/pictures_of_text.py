"""Encode JSON text as a PNG image for `compression: "png"`. Each byte becomes a red, green or blue value."""

from __future__ import annotations

import base64
import math
import struct
import zlib

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_RGB_8_BITS = b"\x08\x02\x00\x00\x00"
_LEVEL = 3


def png_of(text: bytes) -> bytes:
    """Return an RGB image whose channel values are the bytes of `text`, padded with line breaks."""
    pixels = -(-len(text) // 3)
    width = max(math.isqrt(pixels), 1)
    height = max(-(-pixels // width), 1)
    row_bytes = width * 3
    padded = text.ljust(row_bytes * height, b"\n")
    rows = b"".join(b"\0" + padded[start : start + row_bytes] for start in range(0, len(padded), row_bytes))
    header = struct.pack(">II", width, height) + _RGB_8_BITS
    return b"".join(
        (_SIGNATURE, _chunk(b"IHDR", header), _chunk(b"IDAT", zlib.compress(rows, _LEVEL)), _chunk(b"IEND"))
    )


def base64_png_of(text: bytes) -> str:
    """Return the image from `png_of`, encoded as base64."""
    return base64.b64encode(png_of(text)).decode("ascii")


def _chunk(kind: bytes, data: bytes = b"") -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
