"""Pictures as one byte string per channel.

PGM does not require a library; other formats require Pillow.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

from pipros.basics.extras import install_command
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.pgm import MAX_PIXELS, is_pgm, read_pgm

_FORMATS = ("BMP", "GIF", "JPEG", "PCX", "PNG", "PPM", "TGA", "TIFF", "WEBP", "XPM")
"""Formats that Pillow decodes itself. For some others, such as EPS, it runs programs on the content."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture. Each channel has one byte per pixel, row by row from the top.

    Attributes:
        colors: the grey channel, or the red, green and blue channels.
        alpha: the alpha channel, 0 for transparent; None if the picture does not have one.
    """

    width: int
    height: int
    colors: tuple[bytes, ...]
    alpha: bytes | None = None


def decode_picture(content: bytes, file: str) -> Picture:
    """Decode the contents of a picture file. `file` is its name, for error messages.

    Raises:
        PictureError: the content is not a picture, is too large, or needs Pillow, which is not installed.
    """
    if is_pgm(content):
        width, height, pixels = read_pgm(content, file)
        return Picture(width, height, (pixels,))
    return _read_with_pillow(content, file)


def _read_with_pillow(content: bytes, file: str) -> Picture:
    try:
        from PIL import Image
    except ImportError:
        raise PictureError(
            f"{os.path.basename(file)} is not a PGM file, and other pictures need Pillow: "
            + install_command("pictures")
        ) from None
    from io import BytesIO

    try:
        with Image.open(BytesIO(content), formats=_FORMATS) as image:
            if image.width * image.height > MAX_PIXELS:
                raise PictureError(f"{file} must have at most {MAX_PIXELS} pixels, got {image.size}")
            has_alpha = image.mode in ("LA", "RGBA", "PA", "La", "RGBa") or "transparency" in image.info
            if image.mode.startswith("I"):  # Pillow's modes with 16 bits per pixel
                image = image.point(lambda grey: grey / 256).convert("L")  # type: ignore[assignment]
            is_grey = image.mode in ("1", "L", "LA", "La")
            wanted = ("LA" if has_alpha else "L") if is_grey else ("RGBA" if has_alpha else "RGB")
            bands = [band.tobytes() for band in image.convert(wanted).split()]
            size = image.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        if isinstance(error, PictureError):
            raise
        reason = str(error).partition(" <_io")[0]  # Pillow names the object that it reads
        raise PictureError(f"{file} is not an image that Pillow can read: {reason}") from None
    alpha = bands.pop() if has_alpha else None
    return Picture(size[0], size[1], tuple(bands), alpha)
