"""Compute disparities between rectified images with OpenCV's block matchers, as stereo_image_proc does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from pipros_libraries.reconfiguring.server import Setting, Value
from pipros_libraries.vision.extras import numpy as np
from pipros_libraries.vision.opencv import opencv

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array

SCALE: Final = 16
"""Steps per pixel of OpenCV's disparities."""

STEREO_BM: Final = 0
STEREO_SGBM: Final = 1

SETTINGS: Final = (
    Setting("prefilter_size", 9, 5, 255, "window of the normalisation before block matching, pixels"),
    Setting("prefilter_cap", 31, 1, 63, "bound of normalised pixels"),
    Setting("correlation_window_size", 15, 5, 255, "width of the windows to compare, pixels"),
    Setting("min_disparity", 0, -2048, 2048, "smallest disparity to search, pixels"),
    Setting("disparity_range", 64, 32, 4096, "number of disparities to search, pixels"),
    Setting("uniqueness_ratio", 15.0, 0, 100, "margin by which the best match must win, percent"),
    Setting("texture_threshold", 10, 0, 10000, "texture below which block matching finds nothing"),
    Setting("speckle_size", 100, 0, 1000, "areas below this size are dropped, pixels"),
    Setting("speckle_range", 4, 0, 31, "disparities within an area differ by at most this much"),
    Setting("fullDP", False, description="SGBM: search in all directions"),
    Setting("P1", 200.0, 0, 4000, "SGBM: penalty for disparities that differ by 1 from adjacent ones"),
    Setting("P2", 400.0, 0, 4000, "SGBM: penalty for greater differences"),
    Setting("disp12MaxDiff", 0, 0, 128, "SGBM: maximum difference between both directions of matching"),
)


def corrected(values: Mapping[str, Value]) -> dict[str, Value]:
    """Adjust settings for the matchers.

    Make window sizes odd, and round the disparity range down to a multiple of 16.
    """
    new = dict(values)
    for name in ("prefilter_size", "correlation_window_size"):
        new[name] = int(new[name]) | 1
    new["disparity_range"] = int(new["disparity_range"]) // SCALE * SCALE
    return new


class BlockMatcher:
    """A block matcher for settings returned by `corrected`."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        cv2 = opencv("stereo matching")
        window, count = values["correlation_window_size"], values["disparity_range"]
        self.values = values
        if values["stereo_algorithm"] == STEREO_BM:
            self._matcher = cv2.StereoBM_create(count, window)
            self._matcher.setPreFilterSize(values["prefilter_size"])
            self._matcher.setTextureThreshold(values["texture_threshold"])
        else:
            self._matcher = cv2.StereoSGBM_create(numDisparities=count, blockSize=window)
            self._matcher.setMode(cv2.StereoSGBM_MODE_HH if values["fullDP"] else cv2.StereoSGBM_MODE_SGBM)
            self._matcher.setP1(int(values["P1"]))
            self._matcher.setP2(int(values["P2"]))
            self._matcher.setDisp12MaxDiff(values["disp12MaxDiff"])
        self._matcher.setMinDisparity(values["min_disparity"])
        self._matcher.setPreFilterCap(values["prefilter_cap"])
        self._matcher.setUniquenessRatio(int(values["uniqueness_ratio"]))
        self._matcher.setSpeckleWindowSize(values["speckle_size"])
        self._matcher.setSpeckleRange(values["speckle_range"])

    def disparities(self, left: Array, right: Array, factor: int = 1) -> Array:
        """Return the disparities of the left image's pixels as float32.

        Pixels without a match have the disparity (`min_disparity` - 1) * `factor`.

        Args:
            left, right: uint8 images of the same shape.
            factor: factor by which the images are downsampled before matching.

        Raises:
            cv2.error: the images are too small, or have different sizes.
        """
        if factor > 1:
            cv2 = opencv("stereo matching")
            height, width = left.shape
            size = (2 * factor + 1, 2 * factor + 1)
            left, right = (
                np.ascontiguousarray(cv2.GaussianBlur(each, size, factor)[::factor, ::factor])
                for each in (left, right)
            )
            small = self.disparities(left, right)
            large: Array = cv2.resize(small, (width, height), interpolation=cv2.INTER_NEAREST)
            return large * np.float32(factor)
        found: Array = self._matcher.compute(left, right)
        return found.astype(np.float32) * np.float32(1 / SCALE)

    def valid_window(self, width: int, height: int) -> tuple[int, int, int, int]:
        """Return the part of an image in which disparities can be found: x, y, width and height."""
        border, low = self.values["correlation_window_size"] // 2, self.values["min_disparity"]
        left = self.values["disparity_range"] + low + border - 1
        right = width - 1 - (border + low if low >= 0 else max(border, -low))
        return left, border, max(right - left, 0), max(height - 1 - 2 * border, 0)
