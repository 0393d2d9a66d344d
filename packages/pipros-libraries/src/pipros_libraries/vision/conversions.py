"""Convert images between encodings with numpy, with the rules and results of `cv_bridge`.

Genuine `cv_bridge` uses OpenCV, whose wheel takes 162 MB of disk space. Importing it after numpy takes 34 ms
of processor time; importing this module takes 10 ms.
"""

from __future__ import annotations

from typing import Any

from pipros_libraries.pictures.encodings import COLORS, Color, Encoding, UnknownEncoding, encoding
from pipros_libraries.vision.colors import converted as with_color
from pipros_libraries.vision.colors import is_supported
from pipros_libraries.vision.extras import numpy as np


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


def convert_decoded(image: Any, encoding_out: str) -> Any:
    """Convert an image that OpenCV decoded: grey, BGR or BGRA with values of any type. The result is a copy.

    Noetic takes every decoded image for bgr8. The same rules apply here, with the image's real channels: an
    encoding that defines colours converts the channels of other values than uint8, and keeps their type; a
    type with three channels, such as 8UC3, has the order BGR. An empty `encoding_out` means no conversion.

    Raises:
        ImageConversionError: as for `convert`.
    """
    channels = image.shape[2] if image.ndim == 3 else 1
    if channels not in _DECODED:
        raise ImageConversionError(f"a decoded image must have 1, 3 or 4 channels, got {_describe(image)}")
    if encoding_out == "":
        return image.copy()
    source, target = _DECODED[channels], _named(encoding_out)
    in_bgr = target.color is None and target.channels == 3
    colors = _colors(source, encoding("bgr8") if in_bgr else target)
    image = image[:, :, 0] if channels == 1 and image.ndim == 3 else image
    image = with_color(image, *colors) if colors else image
    if image.dtype == np.uint8:
        return with_depth(image, 8, target.bits, target.dtype)
    return image.copy() if target.color else saturated(image, target.dtype)


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


_DECODED = {1: COLORS["mono8"], 3: COLORS["bgr8"], 4: COLORS["bgra8"]}
"""How OpenCV arranges an image that it decodes, by number of channels."""

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


_WHITE_RATIO = 65535 // 255
_INT32 = np.iinfo(np.int32)


def saturated(values: Any, dtype: str) -> Any:
    """Convert `values` to `dtype`, rounding half to even and saturating to the range of the type.

    As in OpenCV, if floats are converted to integers, NaN and values outside the range of int32 are first
    replaced by the minimum of int32.
    """
    target = np.dtype(dtype)
    if target.kind == "f":
        with np.errstate(over="ignore"):
            return values.astype(target)
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            rounded = np.rint(values.astype(np.float64))
            fits = (rounded >= _INT32.min) & (rounded <= _INT32.max)
        values = np.where(fits, rounded, _INT32.min).astype(np.int32)
    limits, held = np.iinfo(target), np.iinfo(values.dtype)
    if limits.min <= held.min and held.max <= limits.max:
        return values.astype(target)
    return np.clip(values.astype(np.int64), limits.min, limits.max).astype(target)


def scaled(values: Any, dtype: str, factor: float) -> Any:
    """Return `saturated(values * factor, dtype)`.

    As in OpenCV, the product is computed in double precision only if one of the types is int32 or float64.
    """
    wide = values.dtype in (np.int32, np.float64) or dtype in ("int32", "float64")
    real = np.float64 if wide else np.float32
    return saturated(values.astype(real) * real(factor), dtype)


def with_depth(image: Any, bits: int, target_bits: int, dtype: str) -> Any:
    """Convert an image to `dtype` with `target_bits` per value. Between 8 and 16 bits, white stays white."""
    # For the common types, integer arithmetic is faster and exact.
    if image.dtype == np.uint8 and dtype == "uint16":
        return image.astype(np.uint16) * np.uint16(_WHITE_RATIO)
    if image.dtype == np.uint16 and dtype == "uint8":
        return ((image.astype(np.uint32) + _WHITE_RATIO // 2) // _WHITE_RATIO).astype(np.uint8)
    if (bits, target_bits) == (8, 16):
        return scaled(image, dtype, 65535 / 255)
    if (bits, target_bits) == (16, 8):
        return scaled(image, dtype, 255 / 65535)
    return image.copy() if image.dtype == dtype else saturated(image, dtype)


# Red, green and blue for the labels 0, 1, 2, …: the CSS colours in alphabetical order.
_COLORS = bytes.fromhex(
    "eff8fff9ebd600ffff7effd3effffff5f5dcffe3c4000000ffebcd0000ff892be1a42a2adeb8865f9e9f7eff00d2691e"
    "ff7e506394ecfff8dcdc133b00ffff00008a008a8ab8850aa9a9a9006300a9a9a9bcb76b8a008a546b2eff8b009931cc"
    "8a0000e995798fbb8f473c8a2e4f4f2e4f4f00ced19300d2ff139200beff6969696969691e90ffb12121fff9ef218a21"
    "ff00ffdcdcdcf8f8ffffd600daa41f808080008000acff2e808080efffefff69b4cd5c5c4a0082ffffefefe68be6e6f9"
    "ffeff57bfb00fff9cdacd7e6ef8080dffffff9f9d2d2d2d290ed90d2d2d2ffb6c1ff9f791fb1aa86cef9778799778799"
    "afc4deffffdf00ff0031cd31f9efe6ff00ff80000066cdaa0000cdb954d2926fdb3bb3707a68ed00f99a47d1ccc61585"
    "18186ff5fff9ffe3e0ffe3b5ffdeac000080fcf5e68080006b8e22ffa400ff4500da6fd5ede8aa97fa97aeededffeed4"
    "ffdab8cd853effc0cadd9fddafdfe6800080ff0000bb8f8f4169e08a4512f98071f9a35f2d8a56fff5ed9f522cc0c0c0"
    "86ceeb6a5acd6f80906f8090fff9f900ff7e4682b4d2b48b008080d7bed7ff624640dfd0ed82edf5deb3fffffff5f5f5"
    "ffff009acd31"
)


def color_of_label(labels: Any) -> Any:
    """Convert an integer image of shape (height, width) to colours.

    The result has the shape (height, width, 3), with the channels blue, green and red.

    Colours repeat after 146 labels. Negative labels are black, except multiples of 146.
    """
    table = np.frombuffer(_COLORS, np.uint8).reshape(-1, 3)[:, ::-1]
    colors = table[labels % len(table)]
    colors[(labels < 0) & (labels % len(table) != 0)] = 0
    return colors
