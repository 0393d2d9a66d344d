"""Read images from a camera or a video file. Importing this module requires OpenCV."""

from __future__ import annotations

from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros_libraries.vision.opencv import opencv

cv2 = opencv("usb_cam")

PIXEL_FORMATS: Final = {
    "yuyv": "YUYV",
    "uyvy": "UYVY",
    "mjpeg": "MJPG",
    "rgb24": "RGB3",
    "grey": "GREY",
    "yuvmono10": "Y10 ",
}
"""Values of usb_cam's `pixel_format`, with their Video4Linux codes."""


class CameraError(PiprosError):
    """A camera or video file cannot be opened, or provides no images."""


class Capture:
    """An open camera or video file.

    Attributes:
        device: the path of the device or file.
    """

    def __init__(self, device: str, width: int, height: int, rate_hz: float, pixel_format: str) -> None:
        """Open a camera or video file, and request an image size, frame rate and pixel format.

        Video files and some cameras ignore the request.

        Raises:
            CameraError: the device or file cannot be opened, or the format is unknown.
        """
        if pixel_format not in PIXEL_FORMATS:
            raise CameraError(f"pixel_format must be one of {', '.join(PIXEL_FORMATS)}, got {pixel_format!r}")
        self.device = device
        self._video = cv2.VideoCapture(device)
        if not self._video.isOpened():
            raise CameraError(f"cannot open the camera {device}: does it exist, and may this user read it?")
        for setting, value in (
            (cv2.CAP_PROP_FOURCC, cv2.VideoWriter_fourcc(*PIXEL_FORMATS[pixel_format])),
            (cv2.CAP_PROP_FRAME_WIDTH, width),
            (cv2.CAP_PROP_FRAME_HEIGHT, height),
            (cv2.CAP_PROP_FPS, rate_hz),
        ):
            self._video.set(setting, value)

    def read(self) -> Any:
        """Return the next image as an array of RGB pixels. Blocks until it arrives or OpenCV times out.

        Raises:
            CameraError: no image can be read, for example because the camera was unplugged or the video has
                ended.
        """
        is_read, image = self._video.read()
        if not is_read:
            raise CameraError(
                f"cannot read an image from {self.device}: "
                "the camera is unplugged or in use, or the video has ended"
            )
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)

    def close(self) -> None:
        """Close the device."""
        self._video.release()
