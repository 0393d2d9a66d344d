"""JPEG and PNG codecs: OpenCV if it is installed (`pipros[vision]`), otherwise Pillow (`pipros[pictures]`).

Arrays have OpenCV's layout: the shape is (height, width) for grey images, or (height, width, channels) with
channels in the order blue, green, red, alpha.
"""

from __future__ import annotations

import io
from typing import Any, Final, Protocol

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command, missing, optional
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.headers import pixel_count

try:
    import numpy as np
except ImportError as error:
    raise missing("pictures need numpy", "numpy", error) from error

MAX_PIXELS: Final = 178_956_970
"""Maximum size of a decoded image, as in Pillow: a file of a few kilobytes can describe many gigabytes."""


class Codec(Protocol):
    """Interface of an image codec. Threads may share an instance."""

    def decode(self, data: bytes) -> Any:
        """Decode a JPEG or PNG image to an array.

        Raises:
            PictureError: the data is not a valid image.
        """

    def encode(self, image: Any, kind: str, level: int) -> bytes:
        """Encode an array as an image.

        Args:
            kind: `jpeg` or `png`.
            level: quality from 0 to 100 for `jpeg`, compression from 0 to 9 for `png`.

        Raises:
            PictureError: the format does not support the array.
        """


def codec() -> Codec:
    """Return the OpenCV codec, or the Pillow codec if OpenCV is not installed.

    Raises:
        ImportError: neither OpenCV nor Pillow is installed. The message explains how to install them.
    """
    if cv2 := optional("cv2"):
        return OpenCVCodec(cv2)
    try:
        from PIL import Image
    except ImportError as error:
        raise MissingExtra(
            "compressed images need OpenCV or Pillow, and neither is installed. "
            f"Try: {install_command('vision')} or {install_command('numpy', 'pictures')}",
            name=error.name,
        ) from error
    return PillowCodec(Image)


class OpenCVCodec:
    """Codec that uses OpenCV.

    Args:
        cv2: the module `cv2`.
    """

    def __init__(self, cv2: Any) -> None:
        self._cv2 = cv2

    def decode(self, data: bytes) -> Any:
        pixels = pixel_count(data)
        if data and pixels is None:
            raise PictureError(
                f"the image ({len(data)} bytes) must be a JPEG, PNG, TIFF, BMP, WebP or JPEG 2000 image"
            )
        if pixels and pixels > MAX_PIXELS:
            raise PictureError(
                f"the image ({len(data)} bytes) must have at most {MAX_PIXELS} pixels, got {pixels}"
            )
        try:
            image = (
                self._cv2.imdecode(np.frombuffer(data, np.uint8), self._cv2.IMREAD_UNCHANGED)
                if data
                else None
            )
        except self._cv2.error as error:  # for example, because the image has too many pixels
            raise PictureError(f"OpenCV cannot decode the image ({len(data)} bytes): {error}") from error
        if image is None:
            raise PictureError(f"OpenCV cannot decode the image ({len(data)} bytes)")
        return image

    def encode(self, image: Any, kind: str, level: int) -> bytes:
        option = self._cv2.IMWRITE_JPEG_QUALITY if kind == "jpeg" else self._cv2.IMWRITE_PNG_COMPRESSION
        try:
            is_written, data = self._cv2.imencode(
                ".jpg" if kind == "jpeg" else ".png", image, [option, level]
            )
        except self._cv2.error as error:
            raise PictureError(f"OpenCV cannot write {_describe(image)} as {kind}: {error}") from error
        if not is_written:
            raise PictureError(f"OpenCV cannot write {_describe(image)} as {kind}")
        return bytes(data)


class PillowCodec:
    """Codec that uses Pillow. Colour images must have 8 bits per channel; grey PNG images may have 16 bits.

    Args:
        image_module: the module `PIL.Image`.
    """

    def __init__(self, image_module: Any) -> None:
        self._images = image_module

    def decode(self, data: bytes) -> Any:
        try:
            with self._images.open(io.BytesIO(data), formats=("JPEG", "PNG")) as picture:
                if picture.mode.startswith("I"):
                    return np.asarray(picture).astype(np.uint16)
                if picture.mode not in ("L", "RGB", "RGBA"):
                    picture = picture.convert("L" if picture.mode == "1" else "RGB")
                image = np.asarray(picture)
        except (OSError, SyntaxError, ValueError, self._images.DecompressionBombError) as error:
            raise PictureError(f"Pillow cannot decode the image ({len(data)} bytes): {error}") from error
        return image if image.ndim == 2 else _swap_red_and_blue(image)

    def encode(self, image: Any, kind: str, level: int) -> bytes:
        is_deep = image.dtype == np.uint16
        if image.dtype not in (np.uint8, np.uint16) or (is_deep and (image.ndim == 3 or kind == "jpeg")):
            raise PictureError(
                f"Pillow cannot write {_describe(image)} as {kind}. Try OpenCV: {install_command('vision')}"
            )
        if image.ndim == 3:
            image = _swap_red_and_blue(image[:, :, :3] if kind == "jpeg" else image)
        file = io.BytesIO()
        options = {"quality": level} if kind == "jpeg" else {"compress_level": level}
        try:
            self._images.fromarray(image).save(file, kind.upper(), **options)
        except (OSError, TypeError, ValueError) as error:
            raise PictureError(f"Pillow cannot write {_describe(image)} as {kind}: {error}") from error
        return file.getvalue()


def _swap_red_and_blue(image: Any) -> Any:
    """Swap the red and blue channels."""
    return np.ascontiguousarray(image[:, :, [2, 1, 0, 3][: image.shape[2]]])


def _describe(image: Any) -> str:
    return f"an array of {image.dtype} of shape {image.shape}"
