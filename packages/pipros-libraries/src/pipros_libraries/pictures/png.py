"""Encode complete images as PNG.

Pillow is not used, because it is a 7 MB wheel, takes 21 ms to import, and does not support 16-bit colours.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable

from pipros.basics.extras import optional

_COLOUR_TYPES = {1: 0, 3: 2, 4: 6}
"""PNG's colour type numbers for grey, RGB and RGBA, keyed by number of channels."""

_BAND_BYTES = 100_000
"""Approximate size of the rows filtered together. Touching new memory takes longer than filtering."""


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
    return _file(width, height, channels, bits, zlib.compress(b"".join(b"\0" + row for row in rows), level))


def photo_png(
    width: int,
    height: int,
    channels: int,
    bits: int,
    data: bytes | bytearray,
    step: int,
    *,
    is_bgr: bool = False,
    is_little: bool = False,
) -> bytes:
    """Like `png`, for pictures of a camera, whose rows begin every `step` bytes.

    Their colours may be in the order BGR, and 16 bits may begin with the less significant byte. With numpy,
    differences of neighbouring pixels are stored, without a search for repetitions, which photos do not have:
    the files are smaller, and take a third of the time.
    """
    size = bits // 8
    pixel, row = channels * size, width * channels * size
    is_swapped = is_little and size == 2
    numpy = optional("numpy")
    if numpy is None:
        rows = (data[top : top + row] for top in range(0, height * step, step))
        ordered_rows = (_ordered(each, channels, size, is_bgr, is_swapped) for each in rows)
        return png(width, height, channels, bits, ordered_rows)
    kind = f"{'<' if is_swapped else '>'}u{size}"
    rows_of_bytes = numpy.frombuffer(data, "u1", height * step).reshape(height, step)[:, :row]
    values = rows_of_bytes.view(kind).reshape(height, width, channels)
    count = max(1, _BAND_BYTES // row)
    ordered = numpy.empty((count, width, channels), f">u{size}")
    lines = numpy.ones((count, 1 + row), "u1")  # each begins with 1, the filter `Sub`
    compressor = zlib.compressobj(1, strategy=zlib.Z_RLE)
    parts = []
    for top in range(0, height, count):
        band = values[top : top + count]
        for channel, origin in enumerate((2, 1, 0, 3)[:channels] if is_bgr else range(channels)):
            ordered[: len(band), :, channel] = band[..., origin]
        pixels = ordered[: len(band)].view("u1").reshape(len(band), row)
        filtered = lines[: len(band)]
        filtered[:, 1 : 1 + pixel] = pixels[:, :pixel]
        numpy.subtract(pixels[:, pixel:], pixels[:, :-pixel], out=filtered[:, 1 + pixel :])
        parts.append(compressor.compress(filtered.data))
    return _file(width, height, channels, bits, b"".join((*parts, compressor.flush())))


def _ordered(
    row: bytes | bytearray, channels: int, size: int, is_bgr: bool, is_swapped: bool
) -> bytes | bytearray:
    """Return a row of values of `size` bytes in PNG's order."""
    line = bytearray(row)
    if is_swapped:
        line[0::2], line[1::2] = line[1::2], line[0::2]
    for byte in range(size if is_bgr else 0):
        stride, red = channels * size, byte + 2 * size
        line[byte::stride], line[red::stride] = line[red::stride], line[byte::stride]
    return line


def _file(width: int, height: int, channels: int, bits: int, pixels: bytes) -> bytes:
    head = struct.pack(">IIBBBBB", width, height, bits, _COLOUR_TYPES[channels], 0, 0, 0)
    parts = (_part(b"IHDR", head), _part(b"IDAT", pixels), _part(b"IEND", b""))
    return b"".join((b"\x89PNG\r\n\x1a\n", *parts))


def _part(name: bytes, data: bytes) -> bytes:
    check = zlib.crc32(data, zlib.crc32(name))
    return b"".join((struct.pack(">I", len(data)), name, data, struct.pack(">I", check)))
