"""Reader of map images: PGM requires no library; other formats require Pillow."""

from __future__ import annotations

import os
from dataclasses import dataclass

from pipros.basics.extras import install_command
from pipros.basics.input_file import read_file
from pipros.libraries.maps.errors import BadMapImage, NoMapFile
from pipros.libraries.maps.pgm import MAX_PIXELS, is_pgm, read_pgm

_FILE_BYTES = 2 * MAX_PIXELS + 4096


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture; each channel has one byte per pixel, row by row from the top.

    Attributes:
        colors: the grey channel, or red, green and blue.
        alpha: the alpha channel, 0 for transparent; None if there is none.
    """

    width: int
    height: int
    colors: tuple[bytes, ...]
    alpha: bytes | None = None


def read_picture(file: str) -> Picture:
    """Read an image from a file.

    Raises:
        NoMapFile: the file cannot be opened.
        BadMapImage: the file is not an image, is too large, or needs Pillow, which is not installed.
    """
    try:
        content = read_file(file, _FILE_BYTES)
    except OSError as error:
        raise NoMapFile(f"cannot read the image {file}: {error.strerror}") from None
    if is_pgm(content):
        width, height, pixels = read_pgm(content, file)
        return Picture(width, height, (pixels,))
    return _read_with_pillow(content, file)


def _read_with_pillow(content: bytes, file: str) -> Picture:
    try:
        from PIL import Image
    except ImportError:
        raise BadMapImage(
            f"{os.path.basename(file)} is not a PGM file, and other pictures need Pillow: "
            f"{install_command('pictures')}"
        ) from None
    from io import BytesIO

    try:
        with Image.open(BytesIO(content)) as image:
            if image.width * image.height > MAX_PIXELS:
                raise BadMapImage(f"{file} must have at most {MAX_PIXELS} pixels, got {image.size}")
            has_alpha = image.mode in ("LA", "RGBA", "PA", "La", "RGBa") or "transparency" in image.info
            if image.mode.startswith("I"):  # 16 bits per pixel
                image = image.point(lambda grey: grey / 256).convert("L")  # type: ignore[assignment]
            is_grey = image.mode in ("1", "L", "LA", "La")
            wanted = ("LA" if has_alpha else "L") if is_grey else ("RGBA" if has_alpha else "RGB")
            bands = [band.tobytes() for band in image.convert(wanted).split()]
            size = image.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        if isinstance(error, BadMapImage):
            raise
        raise BadMapImage(f"{file} is not an image that Pillow can read: {error}") from None
    alpha = bands.pop() if has_alpha else None
    return Picture(size[0], size[1], tuple(bands), alpha)
