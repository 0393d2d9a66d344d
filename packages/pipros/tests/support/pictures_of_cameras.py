"""Images, depths and calibrations of imaginary cameras, for nodelets and their genuine counterparts."""

from typing import Any

import numpy as np

from pipros.msg import load_message_class
from pipros.msg.time import Time

SIZE = (480, 640)


def header(number: int, frame: str = "camera") -> Any:
    """Return the header of the message of a moment."""
    return load_message_class("std_msgs/Header")(stamp=Time(1000 + number, 5000), frame_id=frame)


def camera_info(number: int, *, size: tuple[int, int] = SIZE, frame: str = "camera", **fields: Any) -> Any:
    """Return a calibration; `fields` replace those of a lens that distorts."""
    height, width = size
    x, y = width / SIZE[1], height / SIZE[0]
    info: Any = load_message_class("sensor_msgs/CameraInfo")()
    info.header, (info.height, info.width) = header(number, frame), size
    info.distortion_model, info.D = "plumb_bob", [-0.28, 0.07, 0.0003, -0.0004, 0.01]
    info.K = [520.1 * x, 0, 321.3 * x, 0, 518.7 * y, 241.9 * y, 0, 0, 1]
    info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [500.2 * x, 0, 321.3 * x, 0, 0, 499.8 * y, 240.4 * y, 0, 0, 0, 1, 0]
    for name, value in fields.items():
        setattr(info, name, value)
    return info


def right_info(number: int) -> Any:
    """Return the calibration of the right one of two cameras."""
    info = camera_info(number)
    info.P[3] = -0.12 * info.P[0]
    return info


def image(array: Any, encoding: str, number: int, frame: str = "camera") -> Any:
    """Return an image message."""
    pixels = np.ascontiguousarray(array)
    message: Any = load_message_class("sensor_msgs/Image")()
    message.header, message.encoding = header(number, frame), encoding
    message.height, message.width = pixels.shape[:2]
    message.step, message.data = pixels.nbytes // pixels.shape[0], pixels.tobytes()
    return message


def picture(channels: int = 3, size: tuple[int, int] = SIZE, dtype: Any = np.uint8, detail: int = 8) -> Any:
    """Return a smooth random picture; all calls with the same arguments return the same one."""
    import cv2

    height, width = size
    coarse = np.random.default_rng(channels).integers(0, 256, (height // detail, width // detail, channels))
    smooth = cv2.resize(coarse.astype(np.float32), (width, height), interpolation=cv2.INTER_CUBIC)
    scaled = np.clip(smooth, 0, 255) * (257 if dtype == np.uint16 else 1)
    return scaled.astype(dtype) if channels > 1 else scaled.astype(dtype).reshape(size)


def depths(encoding: str, size: tuple[int, int] = SIZE) -> Any:
    """Return depths from 0.4 to 4 m, 5 % of which are unknown."""
    metres = picture(1, size, np.float32) / 70 + np.float32(0.4)
    unknown = np.random.default_rng(5).random(size) < 0.05
    if encoding == "32FC1":
        return np.where(unknown, np.float32(np.nan), metres)
    return np.where(unknown, 0, metres * 1000).astype(np.uint16)


def stereo_pair() -> tuple[Any, Any]:
    """Return pictures of a wavy surface with disparities from 0 to 40 pixels."""
    import cv2

    height, width = SIZE
    surface = picture(1, (height, width + 160), detail=4)
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    wave = 20 + 12 * np.sin(y / 60) + 8 * np.cos(x / 90)
    right = cv2.remap(surface, (x + 60 + wave).astype(np.float32), y, cv2.INTER_LINEAR)
    return np.ascontiguousarray(surface[:, 60 : 60 + width]), right
