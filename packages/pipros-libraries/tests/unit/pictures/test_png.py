"""PNG files of cameras' pictures."""

from __future__ import annotations

import io
import random
import sys

import pytest
from PIL import Image

from pipros_libraries.pictures.png import photo_png, png

WIDTH, HEIGHT = 40, 30
MODES = {(1, 8): "L", (3, 8): "RGB", (4, 8): "RGBA", (1, 16): "I;16"}


def photo(channels: int, bits: int) -> list[bytes]:
    """Return rows of brightness that rises smoothly, with noise."""
    noise = random.Random(1)  # noqa: S311 # repeatable
    size = channels * bits // 8
    return [
        bytes((6 * x + 3 * y + noise.randrange(4)) % 256 for x in range(WIDTH) for _ in range(size))
        for y in range(HEIGHT)
    ]


def reversed_row(row: bytes, channels: int, bits: int) -> bytes:
    """Return a row in the order BGR, whose 16-bit values are little-endian."""
    size = bits // 8
    values = [row[at : at + size][::-1] for at in range(0, len(row), size)]
    order = (2, 1, 0, 3)[:channels] if channels > 1 else (0,)
    pixels = [values[at : at + channels] for at in range(0, len(values), channels)]
    return b"".join(pixel[channel] for pixel in pixels for channel in order)


@pytest.mark.parametrize("has_numpy", [True, False])
@pytest.mark.parametrize("is_reversed", [True, False])
@pytest.mark.parametrize(("channels", "bits"), MODES)
def test_a_photo_keeps_its_pixels(
    channels: int, bits: int, is_reversed: bool, has_numpy: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not has_numpy:
        monkeypatch.setitem(sys.modules, "numpy", None)
    rows = photo(channels, bits)
    given = [reversed_row(row, channels, bits) if is_reversed else row for row in rows]
    options = {"is_bgr": is_reversed and channels > 1, "is_little": is_reversed}
    step = len(rows[0]) + 3
    data = b"".join(row + b"pad" for row in given)
    found = Image.open(io.BytesIO(photo_png(WIDTH, HEIGHT, channels, bits, data, step, **options)))
    assert (found.mode, found.size) == (MODES[channels, bits], (WIDTH, HEIGHT))
    pixels = found.tobytes()
    if bits == 16:  # Pillow's are little-endian
        pixels = b"".join(pixels[at : at + 2][::-1] for at in range(0, len(pixels), 2))
    assert pixels == b"".join(rows)


def test_a_photo_is_smaller_than_other_pictures_with_the_same_pixels() -> None:
    rows = photo(3, 8)
    photo_file = photo_png(WIDTH, HEIGHT, 3, 8, b"".join(rows), len(rows[0]))
    assert 1.3 * len(photo_file) < len(png(WIDTH, HEIGHT, 3, 8, rows))
