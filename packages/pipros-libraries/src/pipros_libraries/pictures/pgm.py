"""Greyscale images as PGM files, binary (P5) and plain (P2): https://netpbm.sourceforge.net/doc/pgm.html.

Most maps are PGM files. For these, `map_server` and `map_saver` do not need Pillow. Pillow (7 MB to download,
21 ms to import) takes 35 ms to read a map of 4,000 x 4,000 cells, while this module takes 2 ms. For plain
files, both take about the same time.
"""

from __future__ import annotations

import re
from array import array

from pipros_libraries.pictures.errors import PictureError

MAX_PIXELS = 1 << 28
"""Maximum size of a picture: 16,384 x 16,384 pixels, which use 256 MiB as map cells."""

_TOKEN = re.compile(rb"#[^\n\r]*|\d{1,9}|[^\s]")
_PART = re.compile(rb"#[^\n\r]*\s*|[^#]{1,65536}[^#\s]*")
"""A comment, or whole words. A pattern that repeats a group would need memory for each repetition."""


def is_pgm(content: bytes) -> bool:
    """Return whether the content starts with the signature of a PGM file."""
    return content[:2] in (b"P5", b"P2")


def read_pgm(content: bytes, file: str) -> tuple[int, int, bytes]:
    """Return the width, the height, and one byte per pixel, row by row from the top. 255 is white.

    Raises:
        PictureError: the content is not a PGM file, is too large, or is truncated.
    """
    if not is_pgm(content):
        raise PictureError(f"{file} must start with P5 or P2, got {content[:2]!r}")
    tokens = (each for each in _TOKEN.finditer(content, 2) if not each[0].startswith(b"#"))
    place, header = 2, []
    for what in ("width", "height", "maximum grey value"):
        found = next(tokens, None)
        if found is None or not found[0].isdigit():
            raise PictureError(f"{file}: {what} must be an integer, got {content[place : place + 20]!r}")
        header.append(int(found[0]))
        place = found.end()
    width, height, white = header
    if not (width > 0 and height > 0 and width * height <= MAX_PIXELS):
        raise PictureError(f"{file} must have 1 to {MAX_PIXELS} pixels, got {width} x {height}")
    if not 0 < white < 65536:
        raise PictureError(f"{file}: maximum grey value must be 1 to 65535, got {white}")
    if content[:2] == b"P2":
        return width, height, _from_digits(content, place, width * height, white, file)
    size = width * height * (1 if white < 256 else 2)
    pixels = content[place + 1 : place + 1 + size]  # the pixels follow one white-space character
    if len(pixels) < size:
        raise PictureError(f"{file} must have {size} bytes of pixel data, got {len(pixels)}")
    if white == 255:
        return width, height, pixels
    if white < 256:
        return width, height, pixels.translate(bytes(min(grey, white) * 255 // white for grey in range(256)))
    wide = array("H", pixels)
    if wide.itemsize == 2 and array("H", b"\0\1")[0] != 1:
        wide.byteswap()  # the file is big-endian
    return width, height, bytes(min(grey, white) * 255 // white for grey in wide)


def _from_digits(content: bytes, place: int, count: int, white: int, file: str) -> bytes:
    greys = bytearray()
    for part in _PART.finditer(content, place):
        if content[part.start()] == ord("#"):
            continue
        words = part[0].split()[: count - len(greys)]
        try:
            greys += bytes([min(int(word), white) * 255 // white if len(word) < 10 else -1 for word in words])
        except ValueError:
            break
    if len(greys) < count:
        raise PictureError(f"{file} must contain {count} integers >= 0, one for each pixel")
    return bytes(greys)


def write_pgm(width: int, height: int, pixels: bytes, comment: str) -> bytes:
    """Return the contents of a binary PGM file. `pixels` has one byte per pixel, row by row from the top."""
    return b"P5\n# %s\n%d %d\n255\n" % (comment.encode("ascii", "replace"), width, height) + pixels
