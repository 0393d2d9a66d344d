"""Check `sensor_msgs/Image` messages, and convert them to PNG or NPY."""

from __future__ import annotations

import io
from typing import Any

from pipros.basics.extras import missing
from pipros.basics.printable import printable
from pipros_libraries.pictures.encodings import Color, Encoding, UnknownEncoding, encoding, shown_encoding
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.png import photo_png
from pipros_libraries.pictures.yuv import LAYOUTS, plane_rows, rgb_rows

IMAGE_TYPES = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")


def encoding_of(message: Any) -> Encoding:
    """Return the encoding with which to show an image's pixels.

    Raises:
        PictureError: the encoding is unknown or cannot be shown, or pixels are missing.
    """
    try:
        found = shown_encoding(message.encoding)
    except UnknownEncoding:
        found = None
    if found is None or found.color is None:
        raise PictureError(f"cannot show images with the encoding [{printable(message.encoding)}]")
    _check_size(message, found)
    return found


def _check_size(message: Any, found: Encoding) -> None:
    width, height, step = message.width, message.height, message.step
    row = width * found.channels * found.bits // 8
    if step < row or len(message.data) < step * height:
        raise PictureError(
            f"{width} x {height} pixels of {message.encoding} need {height} rows of {row} bytes, got "
            f"{len(message.data)} bytes in rows of {step}"
        )


def image_npy(message: Any) -> bytes:
    """Return the contents of an NPY file with the pixels of an image in any encoding, without conversion.

    The array is indexed by row, column and, if there are several, channel. NV12 and NV21 images have the
    rows of both planes.

    Raises:
        PictureError: the encoding is unknown, or there are no pixels, or pixels are missing.
    """
    if not message.width or not message.height:
        raise PictureError(f"the image is empty: {message.width} x {message.height} pixels")
    name = message.encoding
    try:
        found = Encoding(name, "8U", 2) if len(LAYOUTS.get(name, "")) == 4 else None
        found = found or (Encoding(name, "8U", 1) if name in LAYOUTS else encoding(name))
    except UnknownEncoding as error:
        raise PictureError(printable(error)) from None
    _check_size(message, found)
    rows = message.height
    if name in LAYOUTS:
        rows = plane_rows(name, rows, len(message.data), message.step)
        if len(message.data) < rows * message.step:
            raise PictureError(f"{rows} rows of {name} need more than {len(message.data)} bytes")
    size = message.width * found.channels * found.bits // 8
    tops = range(0, rows * message.step, message.step)
    data = b"".join(bytes(message.data[top : top + size]) for top in tops)
    shape = (rows, message.width, *([found.channels] if found.channels > 1 else []))
    kind = {"U": "u", "S": "i", "F": "f"}[found.depth[-1]]
    order = "|" if found.bits == 8 else ">" if message.is_bigendian else "<"
    return npy(f"{order}{kind}{found.bits // 8}", shape, data)


def npy(dtype: str, shape: tuple[int, ...], data: bytes) -> bytes:
    """Return the contents of an NPY file: a header of a multiple of 64 bytes, and the data in C order."""
    head = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}"
    head += " " * (-(len(head) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode() + data


def is_in_png(name: str) -> bool:
    """Return whether PNG can store the pixels of an encoding."""
    try:
        found = shown_encoding(name)
    except UnknownEncoding:
        return name in LAYOUTS
    return name in LAYOUTS or (found.color is not None and found.depth in ("8U", "16U"))


def image_png(message: Any) -> bytes:
    """Return the contents of a PNG file for an image. Bayer patterns are written in grey.

    Raises:
        PictureError: see `encoding_of`; or the image has no pixels, or PNG does not support the encoding.
        MissingExtra: the encoding is a form of YUV, and numpy is not installed.
    """
    if message.encoding in LAYOUTS:
        return _yuv_png(message)
    found = encoding_of(message)
    if not message.width or not message.height:
        raise PictureError(f"the image is empty: {message.width} x {message.height} pixels")
    if found.depth not in ("8U", "16U"):
        raise PictureError(
            f"PNG supports only grey and RGB values with 8 or 16 bits, got [{message.encoding}]"
        )
    is_bgr, is_little = found.color in (Color.BGR, Color.BGRA), not message.is_bigendian
    shape = message.width, message.height, found.channels, found.bits
    return photo_png(*shape, message.data, message.step, is_bgr=is_bgr, is_little=is_little)


def _yuv_png(message: Any) -> bytes:
    content = image_npy(message)
    try:
        import numpy
    except ImportError as error:
        raise missing("images in YUV need numpy", "numpy", error) from error
    pixels = numpy.load(io.BytesIO(content))
    rgb = rgb_rows(message.encoding, message.width, pixels.reshape(len(pixels), -1))
    return photo_png(rgb.shape[1], rgb.shape[0], 3, 8, rgb.tobytes(), 3 * rgb.shape[1])
