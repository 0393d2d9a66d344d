"""Read map images."""

from __future__ import annotations

from pipros.basics.input_file import read_file
from pipros.libraries.maps.errors import BadMapImage, NoMapFile
from pipros.pictures.errors import PictureError
from pipros.pictures.pgm import MAX_PIXELS
from pipros.pictures.planes import Picture, decode_picture

_FILE_BYTES = 2 * MAX_PIXELS + 4096


def read_picture(file: str) -> Picture:
    """Read a picture from a file.

    Raises:
        NoMapFile: the file cannot be opened.
        BadMapImage: the file is not a picture, is too large, or needs Pillow, which is not installed.
    """
    try:
        return decode_picture(read_file(file, _FILE_BYTES), file)
    except OSError as error:
        raise NoMapFile(f"cannot read the image {file}: {error.strerror}") from None
    except PictureError as error:
        raise BadMapImage(str(error)) from None
