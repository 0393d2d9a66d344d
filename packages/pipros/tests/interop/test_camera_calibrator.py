"""Debian's `cameracalibrator.py`, unmodified, on rospy of pipros, with its OpenCV window on a page."""

import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.rate import Timer
from tests.support.page import Page
from tests.support.pictures_of_cameras import image
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SCRIPT = Path("/usr/lib/camera_calibration/cameracalibrator.py")
PACKAGE = Path("/usr/lib/python3/dist-packages/camera_calibration")
CAMERA = np.array([[520.0, 0, 320], [0, 520, 240], [0, 0, 1]])
COLUMNS, ROWS, SQUARE_M = 8, 6, 0.1
TURNS = (
    (0.0, 0.0, 0.0), (0.6, 0.0, 0.1), (0.0, 0.6, -0.1), (-0.5, 0.4, 0.2), (0.4, 0.5, -0.3), (-0.6, -0.3, 0.0),
)  # fmt: skip
PIXELS = 40  # of a square in the flat picture
CALIBRATE, COMMIT = (690, 230), (690, 430)
"""The middle of two buttons beside the picture."""


def board() -> Any:
    """Return a flat picture of a board with 8 x 6 inner corners and a white border."""
    squares = np.indices((ROWS + 3, COLUMNS + 3)).sum(axis=0) % 2
    squares[[0, -1]] = 1
    squares[:, [0, -1]] = 1
    return np.kron(squares * 255, np.ones((PIXELS, PIXELS))).astype(np.uint8)


def seen(turn: tuple[float, float, float], middle: tuple[float, float, float]) -> Any:
    """Return a camera's picture of the board, whose middle is at a position (m)."""
    rotation = cv2.Rodrigues(np.array(turn))[0]
    scale = SQUARE_M / PIXELS
    height, width = board().shape
    centered = np.array([[scale, 0, -scale * width / 2], [0, scale, -scale * height / 2], [0, 0, 1]])
    plane = np.column_stack([rotation[:, 0], rotation[:, 1], middle])
    return cv2.warpPerspective(board(), CAMERA @ plane @ centered, (640, 480), borderValue=128)


def poses() -> list[Any]:
    """Return pictures at all sides of the view, near and far, and tilted."""
    found = []
    for z in (1.2, 1.8, 2.6):
        for x, y in ((0, 0), (-0.28, 0), (0.28, 0), (0, -0.22), (0, 0.22), (-0.25, -0.2), (0.25, 0.2)):
            for turn in TURNS:
                found.append(seen(turn, (x * z / 1.2, y * z / 1.2, z)))
    return found


def test_debians_calibrator_finds_the_lens_of_a_camera(ros: RosSystem) -> None:
    ros.serve_master()
    site = ros.home / "site"
    site.mkdir()
    (site / "camera_calibration").symlink_to(PACKAGE)
    if sys.version_info >= (3, 12):  # the calibrator needs a module that Python no longer has
        (site / "distutils").mkdir()
        (site / "distutils" / "version.py").write_text(
            "from packaging.version import Version as LooseVersion\n"
        )
    service: Any = load_service_class("sensor_msgs/SetCameraInfo")
    stored: list[Any] = []
    with Node("camera", environment=Environment(master_uri=ros.master_uri)) as node:

        def store(request: Any) -> Any:
            stored.append(request.camera_info)
            return service._response_class(True, "stored")

        node.serve("/camera/set_camera_info", service, store)
        camera = node.advertise("/camera/image_raw", load_message_class("sensor_msgs/Image"), queue_size=1)
        pictures, numbers = poses(), iter(range(10**6))

        def publish(_: object = None) -> None:
            number = next(numbers)
            camera.publish(image(pictures[number % len(pictures)], "mono8", number))

        calibrator = ros.pipros.start(
            *("python3", "-W", "ignore", SCRIPT),
            *("--size", f"{COLUMNS}x{ROWS}", "--square", str(SQUARE_M), "--no-service-check"),
            *("image:=/camera/image_raw", "camera:=/camera"), PYTHONPATH=str(site),
        )  # fmt: skip
        with Page.of(calibrator).connect() as browser:
            timer = Timer(node.clock, 50_000_000, publish)
            try:
                calibrator.wait_for("Added sample 40,", timeout_s=120)
                shown = browser.watch("image", window="display")
                next(shown), next(shown)  # with the button, now that it has enough samples
            finally:
                timer.shutdown()
            click = {"window": "display", "event": cv2.EVENT_LBUTTONDOWN, "flags": 1}
            browser.act("mouse", x=CALIBRATE[0], y=CALIBRATE[1], **click)
            calibrator.wait_for(r"^K = ", timeout_s=120)
            browser.act("mouse", x=COMMIT[0], y=COMMIT[1], **click)
            wait_until(lambda: bool(stored), 60, lambda: calibrator.output[-2000:])
        assert calibrator.wait() == 0
    assert stored[0].distortion_model == "plumb_bob"
    assert np.array(stored[0].K).reshape(3, 3) == pytest.approx(CAMERA, rel=0.03, abs=1e-6)
