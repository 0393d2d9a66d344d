"""Convert images between encodings with numpy, with the rules and results of `cv_bridge`.

Genuine `cv_bridge` uses OpenCV, whose wheel takes 162 MB of disk space. Importing it after numpy takes 34 ms
of processor time; importing this module takes 10 ms.
"""

from __future__ import annotations

from typing import Any

from pipros.libraries.vision.colors import converted as with_color
from pipros.libraries.vision.colors import is_supported
from pipros.libraries.vision.depths import saturated, scaled, with_depth
from pipros.libraries.vision.extras import numpy as np
from pipros.libraries.vision.label_colors import color_of_label
from pipros.pictures.encodings import COLORS, Color, Encoding, UnknownEncoding, encoding


class ImageConversionError(RuntimeError):
    """An image cannot be converted to an encoding, or its array does not match its encoding."""


def convert(image: Any, encoding_in: str, encoding_out: str) -> Any:
    """Convert an array of shape (height, width) or (height, width, channels) to another encoding.

    The result is always a copy. The values equal OpenCV's, except that grey values from Bayer images may be
    greater by 1. White stays white in conversions between 8 and 16 bits. An empty `encoding_out` means
    `encoding_in`.

    Raises:
        ImageConversionError: an encoding is unknown, the conversion is not supported, or the array does not
            match `encoding_in`.
    """
    if not _is_image(image):
        raise ImageConversionError(
            f"the image must be a two- or three-dimensional array, got {_describe(image)}"
        )
    if encoding_out in ("", encoding_in):
        return image.copy()
    source, target = _named(encoding_in), _named(encoding_out)
    colors = _colors(source, target)
    image = image.astype(image.dtype.newbyteorder("="), copy=False)
    _check(image, source)
    if source.channels == 1 and image.ndim == 3:
        image = image[:, :, 0]
    if colors is not None:
        image = with_color(image, *colors)
        if source.bits == target.bits:
            return image
    return with_depth(image, source.bits, target.bits, target.dtype)


def _named(name: str) -> Encoding:
    try:
        return encoding(name)
    except UnknownEncoding:
        raise ImageConversionError(f"Unknown encoding {name}") from None


def _colors(source: Encoding, target: Encoding) -> tuple[Color, Color] | None:
    """Return the pixel formats of the source and target, or None if only the value type changes."""
    names = f"[{source.name}]", f"[{target.name}]"
    if source.color is None and target.color is not None:
        raise ImageConversionError(
            f"{names[0]} is not a color format. but {names[1]} is. The conversion does not make sense"
        )
    if source.color is None or target.color is None:
        if source.channels == target.channels:
            return None
        if source.color is None:
            raise ImageConversionError(f"{names[0]} and {names[1]} do not have the same number of channel")
        raise ImageConversionError(
            f"{names[0]} is a color format but {names[1]} is not so they must have the same OpenCV type, "
            "CV_8UC3, CV16UC1 ...."
        )
    if source.color is target.color and source.color in _WITH_DEPTHS:
        return None
    if source.color is target.color or not is_supported(source.color, target.color):
        raise ImageConversionError(f"Unsupported conversion from {names[0]} to {names[1]}")
    return source.color, target.color


_WITH_DEPTHS = (Color.GRAY, Color.RGB, Color.BGR, Color.RGBA, Color.BGRA)
"""Pixel formats that exist with both 8 and 16 bits."""


def _is_image(image: Any) -> bool:
    return isinstance(image, np.ndarray) and image.ndim in (2, 3)


def _check(image: Any, expected: Encoding) -> None:
    if not _is_image(image):
        raise ImageConversionError(
            f"the image must be a two- or three-dimensional array, got {_describe(image)}"
        )
    channels = image.shape[2] if image.ndim == 3 else 1
    if channels != expected.channels or image.dtype != expected.dtype or image.size == 0:
        raise ImageConversionError(
            f"an image in [{expected.name}] must have {expected.channels} {expected.dtype} per pixel, "
            f"got {_describe(image)}"
        )
    if expected.color is Color.YUV422 and image.shape[1] % 2:
        raise ImageConversionError(
            f"an image in [{expected.name}] must have an even width, got {_describe(image)}"
        )


def _describe(image: Any) -> str:
    if not isinstance(image, np.ndarray):
        return f"a {type(image).__name__}"
    return f"an array of {image.dtype} with shape {image.shape}"


def convert_for_display(
    source: Any,
    encoding_in: str,
    encoding_out: str = "",
    do_dynamic_scaling: bool = False,
    min_image_value: float = 0.0,
    max_image_value: float = 0.0,
) -> Any:
    """Convert an image to 8 bits for display, either in grey or in colour.

    Args:
        encoding_out: output encoding; empty for bgr8.
        do_dynamic_scaling: whether to map the image's minimum to black and its maximum to white.
        min_image_value, max_image_value: values to map to black and white, if they differ.

    In bgr8, the values of a 32SC1 image are labels, which are displayed as colours (see `color_of_label`).

    Raises:
        ImageConversionError: as for `convert`; or `encoding_out` is not an 8-bit grey or colour encoding, or
            scaling was requested for an image with more than one channel.
    """
    target = _display_encoding(encoding_in, encoding_out)
    kind = _named(encoding_in)
    image = source[:, :, 0] if _is_image(source) and source.shape[2:] == (1,) else source
    _check(image, kind)
    if encoding_in == "32SC1" and target.name == "bgr8":
        return color_of_label(image)
    if do_dynamic_scaling:
        min_image_value, max_image_value = (
            float(limit.reduce(image, axis=None)) for limit in (np.fmin, np.fmax)
        )
        if min_image_value == max_image_value:
            return np.full((*image.shape[:2], 3), 128, np.uint8)
    if min_image_value != max_image_value:
        if kind.channels != 1:
            raise ImageConversionError(
                "cv_bridge.cvtColorForDisplay() scaling for images with more than one channel is unsupported"
            )
        above = image.astype(np.float64) - min_image_value
        factor = 255.0 / (max_image_value - min_image_value)
        gray = scaled(saturated(above, str(image.dtype)), "uint8", factor)
        return convert(gray, "mono8", target.name)
    if encoding_in == target.name:
        return image
    try:
        # Show depth images in grey. As in genuine cv_bridge, only 16UC1 images count as depth images.
        return convert(image, "mono16" if encoding_in == "16UC1" else encoding_in, target.name)
    except RuntimeError as error:
        raise ImageConversionError(
            f"cv_bridge.cvtColorForDisplay() while trying to convert image from '{encoding_in}' to "
            f"'{target.name}' an exception was thrown ({error})"
        ) from None


def _display_encoding(encoding_in: str, encoding_out: str) -> Encoding:
    if encoding_out:
        target = COLORS.get(encoding_out)
        if target is None or target.color not in _WITH_DEPTHS or target.bits != 8:
            raise ImageConversionError(
                "cv_bridge.cvtColorForDisplay() does not have an output encoding that is color or mono, and "
                "has is bit in depth"
            )
        return target
    try:
        source = encoding(encoding_in)
        known = source.bits in ((8, 16, 32) if source.channels == 1 else (8, 16))
    except RuntimeError:
        known = False
    if not known:
        raise ImageConversionError(
            "cv_bridge.cvtColorForDisplay() output encoding is empty and cannot be guessed."
        )
    return encoding("bgr8")
