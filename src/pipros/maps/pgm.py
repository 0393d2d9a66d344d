"""Grey pictures as PGM files, binary (P5) and in digits (P2): https://netpbm.sourceforge.net/doc/pgm.html."""

from __future__ import annotations

import re
from array import array

from pipros.maps.errors import BadMapImage

MAX_PIXELS = 1 << 28
"""A map of 16,384 cells square; a message of it has a quarter of a gigabyte."""

_TOKEN = re.compile(rb"(?:\s|#[^\n\r]*[\n\r])*(\d{1,9})")


def is_pgm(content: bytes) -> bool:
    """Whether a file begins as one of the two kinds does."""
    return content[:2] in (b"P5", b"P2")


def read_pgm(content: bytes, file: str) -> tuple[int, int, bytes]:
    """Width, height, and a byte for each pixel, row by row from the top; 255 is white.

    Raises:
        BadMapImage: it is not a PGM file, too large, or ends early.
    """
    if not is_pgm(content):
        raise BadMapImage(f"{file} must begin with P5 or P2, got {content[:2]!r}")
    place, header = 2, []
    for what in ("width", "height", "white"):
        found = _TOKEN.match(content, place)
        if found is None:
            raise BadMapImage(
                f"{file}: the {what} must be a whole number, got {content[place : place + 20]!r}"
            )
        header.append(int(found[1]))
        place = found.end()
    width, height, white = header
    if not (width > 0 and height > 0 and width * height <= MAX_PIXELS):
        raise BadMapImage(f"{file} must have 1 to {MAX_PIXELS} pixels, got {width} x {height}")
    if not 0 < white < 65536:
        raise BadMapImage(f"{file}: the white must be 1 to 65535, got {white}")
    if content[:2] == b"P2":
        return width, height, _from_digits(content[place:], width * height, white, file)
    size = width * height * (1 if white < 256 else 2)
    pixels = content[place + 1 : place + 1 + size]  # one blank comes before them
    if len(pixels) < size:
        raise BadMapImage(f"{file} must have {size} bytes of pixels, got {len(pixels)}")
    if white == 255:
        return width, height, pixels
    if white < 256:
        return width, height, pixels.translate(bytes(min(grey, white) * 255 // white for grey in range(256)))
    wide = array("H", pixels)
    if wide.itemsize == 2 and array("H", b"\0\1")[0] != 1:
        wide.byteswap()  # the file has the higher byte first
    return width, height, bytes(min(grey, white) * 255 // white for grey in wide)


def _from_digits(text: bytes, count: int, white: int, file: str) -> bytes:
    words = re.sub(rb"#[^\n\r]*", b"", text).split(None, count)[:count]
    try:
        greys = [int(word) for word in words if len(word) < 10]
    except ValueError:
        greys = []
    if len(greys) < count or min(greys) < 0:
        raise BadMapImage(f"{file} must have {count} whole numbers for its pixels")
    return bytes(min(grey, white) * 255 // white for grey in greys)


def write_pgm(width: int, height: int, pixels: bytes, comment: str) -> bytes:
    """A binary PGM file of one byte for each pixel, row by row from the top."""
    return b"P5\n# %s\n%d %d\n255\n" % (comment.encode("ascii", "replace"), width, height) + pixels
