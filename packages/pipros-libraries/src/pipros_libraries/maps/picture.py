"""Read map images."""

from __future__ import annotations

from dataclasses import replace

from pipros.basics.input_file import read_file
from pipros_libraries.maps.errors import BadMapImage, NoMapFile
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.pgm import MAX_PIXELS
from pipros_libraries.pictures.planes import Picture, decode_picture

_TIFF = (b"II*\0", b"MM\0*")
_FILE_BYTES = 2 * MAX_PIXELS + 4096


def read_picture(file: str) -> Picture:
    """Read a picture from a file.

    As in Noetic, a picture from a TIFF file always has an alpha channel.

    Raises:
        NoMapFile: the file cannot be read, or is larger than `_FILE_BYTES`.
        BadMapImage: the file is not a picture, has too many pixels, or needs Pillow, which is not installed.
    """
    try:
        content = read_file(file, _FILE_BYTES)
        picture = decode_picture(content, file)
    except OSError as error:
        raise NoMapFile(f"cannot read the image {file}: {error.strerror}") from None
    except PictureError as error:
        raise BadMapImage(str(error)) from None
    if content.startswith(_TIFF) and picture.alpha is None:
        return replace(picture, alpha=b"\xff" * (picture.width * picture.height))
    return picture
