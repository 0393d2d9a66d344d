"""Convert a camera's raw images to colour and grey images, as in image_proc."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from pipros_libraries.pictures.encodings import Color, encoding
from pipros_libraries.vision.conversions import ImageConversionError, convert
from pipros_libraries.vision.opencv import opencv
from pipros_robot.perception.images.arrays import BadImage

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array

BILINEAR: Final = 0
EDGE_AWARE: Final = 1
EDGE_AWARE_WEIGHTED: Final = 2
VNG: Final = 3

_OPENCV_NAMES = {
    # OpenCV names a pattern after the second and third pixel of the second row.
    Color.BAYER_RGGB: "BG",
    Color.BAYER_BGGR: "RG",
    Color.BAYER_GBRG: "GR",
    Color.BAYER_GRBG: "GB",
}
_COLORS = (Color.RGB, Color.BGR, Color.RGBA, Color.BGRA)
_YUV = (Color.YUV422, Color.YUV422_YUY2)


def gray(image: Array, name: str) -> tuple[Array, str]:
    """Convert a raw image to grey. Return the grey image and its encoding.

    Grey images are returned unchanged.

    Raises:
        BadImage: the encoding defines no colours, or does not use 8 or 16 bits.
    """
    kind = encoding(name)
    target = f"mono{kind.bits}"
    if kind.color is None or kind.bits not in (8, 16):
        raise BadImage(f"cannot convert [{name}] to grey")
    if kind.color is Color.GRAY:
        return image, name
    cv2 = opencv("converting images")
    if kind.color in _OPENCV_NAMES:
        return cv2.cvtColor(image, getattr(cv2, f"COLOR_Bayer{_OPENCV_NAMES[kind.color]}2GRAY")), target
    if kind.color in _YUV:
        code = cv2.COLOR_YUV2GRAY_UYVY if kind.color is Color.YUV422 else cv2.COLOR_YUV2GRAY_YUY2
        return cv2.cvtColor(image, code), "mono8"
    return cv2.cvtColor(image, getattr(cv2, f"COLOR_{kind.color.name}2GRAY")), target


def colors(image: Array, name: str, method: int) -> tuple[Array, str]:
    """Convert a raw image to colour. Return the image and its encoding.

    Grey and colour images are returned unchanged.

    Raises:
        BadImage: the encoding defines no colours or no order of channels, or the method does not support it.
    """
    kind = encoding(name)
    if kind.color in (Color.GRAY, *_COLORS):
        return image, name
    if name == "8UC3":
        raise BadImage("the channel order of [8UC3] is ambiguous; the camera must publish bgr8 or rgb8")
    if kind.color in _OPENCV_NAMES:
        cv2 = opencv("converting images")
        suffix = ""
        if method == VNG:
            if kind.bits != 8:  # OpenCV's limit
                raise BadImage(f"VNG needs 8 bits per pixel, got [{name}]; use another method")
            suffix = "_VNG"
        # Like the genuine nodelet, which interpolates the other patterns bilinearly.
        elif method in (EDGE_AWARE, EDGE_AWARE_WEIGHTED) and kind.color is Color.BAYER_GRBG:
            suffix = "_EA"
        code = getattr(cv2, f"COLOR_Bayer{_OPENCV_NAMES[kind.color]}2BGR{suffix}")
        return cv2.cvtColor(image, code), f"bgr{kind.bits}"
    if kind.color in _YUV:
        try:
            return convert(image, name, "bgr8"), "bgr8"
        except ImageConversionError as error:
            raise BadImage(str(error)) from error
    raise BadImage(f"cannot convert [{name}] to colour")
