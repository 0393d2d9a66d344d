"""Cameras and videos, read with OpenCV."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from pipros_libraries.vision.capture import CameraError, Capture

WIDTH, HEIGHT = 64, 48


@pytest.fixture
def video(tmp_path: Path) -> str:
    """A video of two red pictures."""
    path = str(tmp_path / "video.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (WIDTH, HEIGHT))
    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    picture[:, :, 2] = 255  # OpenCV's order is blue, green, red
    for _ in range(2):
        writer.write(picture)
    writer.release()
    return path


def test_a_video_gives_its_images_as_rgb_until_it_ends(video: str) -> None:
    capture = Capture(video, WIDTH, HEIGHT, 30.0, "mjpeg")

    for _ in range(2):
        image = capture.read()
        assert image.shape == (HEIGHT, WIDTH, 3)
        assert image[HEIGHT // 2, WIDTH // 2].tolist() == pytest.approx([255, 0, 0], abs=3)
    with pytest.raises(CameraError, match=r"cannot read an image from .*video\.avi"):
        capture.read()
    capture.close()


def test_a_device_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match=r"cannot open the camera .*none"):
        Capture(str(tmp_path / "none"), WIDTH, HEIGHT, 30.0, "yuyv")


def test_an_unknown_pixel_format_is_refused(video: str) -> None:
    with pytest.raises(CameraError, match=r"pixel_format must be one of yuyv, .* got 'h264'"):
        Capture(video, WIDTH, HEIGHT, 30.0, "h264")
