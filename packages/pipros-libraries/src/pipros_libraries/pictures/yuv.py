"""Images in the encodings YUV 4:2:2 (packed) and YUV 4:2:0 (two planes) as RGB, by ITU-R BT.601."""

from __future__ import annotations

from typing import Any, Final

from pipros.basics.extras import required

LAYOUTS: Final = {
    "yuv422": "uyvy",
    "uyvy": "uyvy",
    "yuv422_yuy2": "yuyv",
    "yuyv": "yuyv",
    "nv12": "uv",
    "nv21": "vu",
}
"""The order of the bytes by encoding: of two pixels, or of the second plane."""


def plane_rows(encoding: str, height: int, size: int, step: int) -> int:
    """Return the number of rows in the data of an image, including those of the second plane.

    The height of NV12 and NV21 images may or may not include the second plane, whose last row belongs to one
    row of pixels if their number is odd.
    """
    if len(LAYOUTS.get(encoding, "yuyv")) == 4 or (size < step * (height * 3 // 2) and height % 3 != 1):
        return height
    return height + (height + 1) // 2


def rgb_rows(encoding: str, width: int, rows: Any) -> Any:
    """Convert the rows of an image, an array of bytes with one row for each row of the data, to RGB.

    The result has the shape (height, width, 3). An odd last column or row has the colours of its neighbour.
    """
    np = required("numpy", "images in YUV need numpy", "numpy")
    order = LAYOUTS[encoding]
    if len(order) == 4:
        luma = rows[:, order.index("y") : 2 * width : 2]
        blue, red = (rows[:, order.index(each) : 2 * width : 4] for each in "uv")
    else:
        height = len(rows) * 2 // 3
        luma, colors = rows[:height, :width], rows[height:]
        blue, red = (colors[:, order.index(each) : width + width % 2 : 2].repeat(2, 0) for each in "uv")
    blue, red = (_fitted(each.repeat(2, 1).astype(np.float32) - 128, luma.shape) for each in (blue, red))
    light = 1.164 * (luma.astype(np.float32) - 16)
    channels = (light + 1.596 * red, light - 0.813 * red - 0.391 * blue, light + 2.018 * blue)
    return np.clip(np.rint(np.stack(channels, 2)), 0, 255).astype(np.uint8)


def _fitted(plane: Any, shape: tuple[int, int]) -> Any:
    """Repeat the last column and row of a plane, or cut the plane, so that it has the shape."""
    np = required("numpy", "images in YUV need numpy", "numpy")
    missing = [(0, max(0, want - have)) for want, have in zip(shape, plane.shape, strict=True)]
    return np.pad(plane, missing, "edge")[: shape[0], : shape[1]]
