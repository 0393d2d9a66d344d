"""Convert pixel values to another type, rounded and saturated as in OpenCV."""

from __future__ import annotations

from typing import Any

from pipros.libraries.vision.extras import numpy as np

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
