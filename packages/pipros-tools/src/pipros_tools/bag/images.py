"""Save `sensor_msgs` images as files.

Raw images are saved as PNG files, or, if PNG does not support the encoding, as NumPy files. Compressed images
are saved unchanged, without the header of depth images. No image library is needed, except for compressed
depths in 32FC1.
"""

from __future__ import annotations

import io
from typing import Any

from pipros.basics.errors import MissingExtra
from pipros.msg.class_finder import installed_class
from pipros_libraries.pictures.compressed import check_complete, content_of, is_depth, pixels_of, suffix_of
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.image_message import image_npy, image_png, is_in_png
from pipros_tools.bag.errors import BagError


def image_file(message: Any) -> tuple[str, bytes]:
    """Return the suffix and the contents of the image file.

    Raises:
        BagError: the image is empty or in an unknown format, has fewer bytes than its size requires, or needs
            a library that is not installed; or the message definition differs from the installed one.
    """
    _check(message)
    try:
        if message._type == "sensor_msgs/CompressedImage":
            if is_depth(message.format) and message.format.startswith("32FC1"):
                return ".npy", image_array_file(message)
            picture = content_of(message.format, bytes(message.data))
            return suffix_of(picture), picture
        if is_in_png(message.encoding):
            return ".png", image_png(message)
        return ".npy", image_npy(message)
    except (PictureError, MissingExtra) as error:
        raise BagError(str(error)) from None


def check_image(message: Any) -> None:
    """Raise `BagError` if a compressed image is empty, cut, or in an unknown format."""
    if message._type == "sensor_msgs/CompressedImage":
        try:
            check_complete(content_of(message.format, bytes(message.data)))
        except PictureError as error:
            raise BagError(str(error)) from None


def image_array_file(message: Any) -> bytes:
    """Return the contents of an NPY file with the pixels of an image. Compressed images are decoded.

    Raises:
        BagError: see `image_file`.
    """
    _check(message)
    try:
        if message._type == "sensor_msgs/Image":
            return image_npy(message)
        import numpy

        from pipros_libraries.pictures.codecs import codec

        file = io.BytesIO()
        pixels = pixels_of(message.format, bytes(message.data), codec())
        numpy.save(file, pixels, allow_pickle=False)
        return file.getvalue()
    except (PictureError, MissingExtra) as error:
        raise BagError(str(error)) from None


def _check(message: Any) -> None:
    installed = installed_class(message._type)
    if installed is None or installed._md5sum != message._md5sum:
        raise BagError(f"the bag's definition of [{message._type}] must equal an installed package's")
