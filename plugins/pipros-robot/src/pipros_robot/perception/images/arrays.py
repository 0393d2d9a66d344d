"""Convert image messages to arrays, without copying if possible, and arrays to image messages."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.msg import load_message_class
from pipros_libraries.pictures.encodings import UnknownEncoding, encoding
from pipros_libraries.vision.extras import numpy as np

if TYPE_CHECKING:
    from sensor_msgs.msg import Image
    from std_msgs.msg import Header

    from pipros_libraries.vision.extras import Array


class BadImage(PiprosError, ValueError):
    """An image has an unknown or unsuitable encoding, an unsuitable size, or too few bytes."""


def array_of(message: Image) -> Array:
    """Return the pixels of a `sensor_msgs/Image`, of shape (height, width) or (height, width, channels).

    The array is in native byte order. Do not change it: if possible, it shares the message's memory.

    Raises:
        BadImage: the encoding is unknown, the data or its step is too small, or the image has no pixels.
    """
    try:
        kind = encoding(message.encoding)
    except UnknownEncoding:
        raise BadImage(f"unknown encoding [{printable(message.encoding)}]") from None
    dtype = np.dtype(kind.dtype).newbyteorder(">" if message.is_bigendian else "<")
    row, (height, width) = message.width * kind.channels * dtype.itemsize, (message.height, message.width)
    if message.step < row or len(message.data) < height * message.step or not height * width:
        raise BadImage(
            f"{width} x {height} pixels of {message.encoding} need {height} rows of {row} bytes, got "
            f"{len(message.data)} bytes in rows of {message.step}"
            if height * width
            else f"an image must have pixels, got {width} x {height}"
        )
    data = np.frombuffer(message.data, np.uint8, height * message.step).reshape(height, message.step)
    if message.step != row:
        data = np.ascontiguousarray(data[:, :row])
    array = data.view(dtype)
    if not dtype.isnative:
        array = array.astype(dtype.newbyteorder("="))
    return array if kind.channels == 1 else array.reshape(height, width, kind.channels)


def image_message(array: Array, encoding_name: str, header: Header) -> Image:
    """Return a `sensor_msgs/Image` that shares the memory of a contiguous array.

    Do not change the array afterwards. Other arrays are copied.
    """
    pixels = np.ascontiguousarray(array)
    message: Image = load_message_class("sensor_msgs/Image")()
    message.header = copy.copy(header)  # publishing sets its seq
    message.height, message.width = pixels.shape[:2]
    message.encoding = encoding_name
    message.step = pixels.nbytes // max(message.height, 1)
    message.data = pixels.reshape(-1).view(np.uint8)
    return message
