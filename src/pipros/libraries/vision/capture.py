"""Images of a camera or a video file, read with OpenCV, which is required to import this module."""

from __future__ import annotations

from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.libraries.vision.opencv import opencv

cv2 = opencv("usb_cam")

PIXEL_FORMATS: Final = {
    "yuyv": "YUYV",
    "uyvy": "UYVY",
    "mjpeg": "MJPG",
    "rgb24": "RGB3",
    "grey": "GREY",
    "yuvmono10": "Y10 ",
}
"""The `pixel_format`s of usb_cam, with the codes of Video4Linux."""


class CameraError(PiprosError):
    """A camera or a video cannot be opened, or delivers no images."""


class Capture:
    """An open camera or video file.

    Attributes:
        device: its path.
    """

    def __init__(self, device: str, width: int, height: int, rate_hz: float, pixel_format: str) -> None:
        """Open it, and request a size, a rate and a format, which a video file and some cameras ignore.

        Raises:
            CameraError: it cannot be opened, or the format is unknown.
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
        """Return the next image as an array of RGB pixels. Waits for the camera, at most some seconds.

        Raises:
            CameraError: there is none: the camera was unplugged, or the video has ended.
        """
        is_read, image = self._video.read()
        if not is_read:
            raise CameraError(f"no image from {self.device}: unplugged, in use, or the end of a video")
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)

    def close(self) -> None:
        """Close the device."""
        self._video.release()
