"""Convert images between pixel formats, with the integer arithmetic of OpenCV's cvtColor."""

from __future__ import annotations

from typing import Any

from pipros_libraries.pictures.encodings import Color
from pipros_libraries.vision.extras import numpy as np

_PLACES = {Color.RGB: (0, 1, 2), Color.BGR: (2, 1, 0), Color.RGBA: (0, 1, 2, 3), Color.BGRA: (2, 1, 0, 3)}
"""Index in (red, green, blue, alpha) of each channel of an image."""

# Weights of red, green and blue for grey values, in units of 2**-15 (ITU-R BT.601).
_GRAY = (9798, 19235, 3735)
_GRAY_SHIFT = 15

# The same weights in units of 2**-14, which OpenCV uses for Bayer patterns.
_BAYER_GRAY = (4899, 9617, 1868)
_BAYER_GRAY_SHIFT = 14

# Coefficients for YUV, in units of 2**-20 (ITU-R BT.601, luma from 16 to 235).
_YUV_SHIFT = 20
_LUMA, _U_TO_BLUE, _U_TO_GREEN, _V_TO_GREEN, _V_TO_RED = 1220542, 2116026, -409993, -852492, 1673527

_BAYER = {
    # The values are the column and row of a red pixel, modulo 2.
    Color.BAYER_RGGB: (0, 0),
    Color.BAYER_BGGR: (1, 1),
    Color.BAYER_GBRG: (0, 1),
    Color.BAYER_GRBG: (1, 0),
}


def is_supported(color: Color, target: Color) -> bool:
    """Return whether images of `color` can be converted to `target`."""
    if color is target:
        return True
    if color in _BAYER:
        return target in (Color.GRAY, Color.RGB, Color.BGR)
    return target is Color.GRAY or target in _PLACES


def converted(image: Any, color: Color, target: Color) -> Any:
    """Convert an image of shape (height, width[, channels]) to another pixel format.

    Values are uint8 or uint16; floats, of which 1 is white, are also converted between grey, RGB and BGR.

    Raises:
        ValueError: the conversion is not supported (see `is_supported`).
    """
    if color is target:
        return image
    if not is_supported(color, target):
        raise ValueError(f"{color.value} images cannot be converted to {target.value}")
    if color in _BAYER:
        return _from_bayer(image, color, target)
    if color is Color.YUV422:
        return np.ascontiguousarray(image[:, :, 1]) if target is Color.GRAY else _from_yuv(image, target)
    if color is Color.GRAY:
        return _arranged((image, image, image, _opaque(image)), target)
    red, green, blue = (image[:, :, _PLACES[color].index(place)] for place in range(3))
    if target is Color.GRAY:
        if image.dtype.kind == "f":
            weights = (weight / (1 << _GRAY_SHIFT) for weight in _GRAY)
            return sum(part * weight for part, weight in zip((red, green, blue), weights, strict=True))
        # The weighted sum fits into 31 bits even for 16-bit values.
        total = red.astype(np.int32) * _GRAY[0]
        total += green.astype(np.int32) * _GRAY[1]
        total += blue.astype(np.int32) * _GRAY[2]
        return _descaled(total, _GRAY_SHIFT).astype(image.dtype)
    alpha = image[:, :, 3] if len(_PLACES[color]) == 4 else _opaque(red)
    return _arranged((red, green, blue, alpha), target)


def _descaled(values: Any, shift: int) -> Any:
    values += 1 << (shift - 1)
    values >>= shift
    return values


def _opaque(channel: Any) -> Any:
    white = 1 if channel.dtype.kind == "f" else np.iinfo(channel.dtype).max
    return np.full(channel.shape, white, channel.dtype)


def _arranged(parts: tuple[Any, Any, Any, Any], target: Color) -> Any:
    """Stack red, green, blue and alpha in the channel order of `target`."""
    return np.stack([parts[place] for place in _PLACES[target]], axis=-1)


def _from_yuv(image: Any, target: Color) -> Any:
    """Convert from YUV 4:2:2, in which every two pixels are stored as the bytes U, Y, V, Y."""
    luma = np.maximum(image[:, :, 1].astype(np.int32) - 16, 0) * _LUMA
    half = 1 << (_YUV_SHIFT - 1)
    u, v = (np.repeat(image[:, start::2, 0].astype(np.int32) - 128, 2, axis=1) for start in (0, 1))
    parts = (
        luma + half + _V_TO_RED * v,
        luma + half + _U_TO_GREEN * u + _V_TO_GREEN * v,
        luma + half + _U_TO_BLUE * u,
    )
    red, green, blue = (np.clip(part >> _YUV_SHIFT, 0, 255).astype(np.uint8) for part in parts)
    return _arranged((red, green, blue, _opaque(red)), target)


def _from_bayer(image: Any, color: Color, target: Color) -> Any:
    """Interpolate a Bayer pattern bilinearly. Border pixels copy their neighbours, as in OpenCV."""
    height, width = image.shape
    channels = 1 if target is Color.GRAY else 3
    result = np.zeros((height, width, channels), image.dtype)
    if height > 2 and width > 2:
        inside = _demosaiced(image.astype(np.int32), _BAYER[color], target is Color.GRAY)
        order = (0,) if target is Color.GRAY else _PLACES[target]
        for place, part in enumerate(order):
            result[1:-1, 1:-1, place] = inside[part]
        result[1:-1, 0], result[1:-1, -1] = result[1:-1, 1], result[1:-1, -2]
        result[0], result[-1] = result[1], result[-2]
    return result[:, :, 0] if target is Color.GRAY else result


def _demosaiced(image: Any, red_at: tuple[int, int], gray: bool) -> Any:
    """Return the red, green and blue values (or only grey) of all pixels that have eight neighbours."""
    height, width = image.shape
    # Each entry is the sum of four values (a value may be repeated), and is divided by 4 at the end.
    colors = np.empty((3, height - 2, width - 2), np.int64 if gray else np.int32)
    for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):

        def near(down: int, right: int, row: int = row, column: int = column) -> Any:
            rows, columns = (
                slice(1 + row + down, height - 1 + down, 2),
                slice(1 + column + right, width - 1 + right, 2),
            )
            return image[rows, columns]

        own = 4 * near(0, 0)
        beside, above = near(0, -1) + near(0, 1), near(-1, 0) + near(1, 0)
        in_red_row, in_red_column = (row + 1) % 2 == red_at[1], (column + 1) % 2 == red_at[0]
        if in_red_row == in_red_column:
            other = near(-1, -1) + near(-1, 1) + near(1, -1) + near(1, 1)
            parts = (own, beside + above, other) if in_red_row else (other, beside + above, own)
        else:
            parts = (2 * beside, own, 2 * above) if in_red_row else (2 * above, own, 2 * beside)
        for place, part in enumerate(parts):
            colors[place, row::2, column::2] = part
    if not gray:
        return _descaled(colors, 2)
    # OpenCV's vectorised code truncates, so its values may be smaller by 1.
    total = sum(weight * part for weight, part in zip(_BAYER_GRAY, colors, strict=True))
    return _descaled(total, _BAYER_GRAY_SHIFT + 2)[np.newaxis]
