"""Encode JSON text as a PNG image for `compression: "png"`. Each byte becomes a red, green or blue value."""

from __future__ import annotations

import base64
import math

from pipros.pictures.png import png


def png_of(text: bytes) -> bytes:
    """Return an RGB image whose channel values are the bytes of `text`, padded with line breaks."""
    pixels = -(-len(text) // 3)
    width = max(math.isqrt(pixels), 1)
    height = max(-(-pixels // width), 1)
    row_bytes = width * 3
    padded = text.ljust(row_bytes * height, b"\n")
    rows = (padded[start : start + row_bytes] for start in range(0, len(padded), row_bytes))
    return png(width, height, 3, 8, rows, level=3)


def base64_png_of(text: bytes) -> str:
    """Return the image from `png_of`, encoded as base64."""
    return base64.b64encode(png_of(text)).decode("ascii")
