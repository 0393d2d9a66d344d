"""usb_cam with a video file as its device, and image_view. Not tested with a real camera."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.nodes import Inbox
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Image: Any = load_message_class("sensor_msgs/Image")
CameraInfo: Any = load_message_class("sensor_msgs/CameraInfo")

WIDTH, HEIGHT = 64, 48


@pytest.fixture
def video(tmp_path: Path) -> Path:
    """A video of 2,000 red pictures."""
    path = tmp_path / "video.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (WIDTH, HEIGHT))
    picture = numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8)
    picture[:, :, 2] = 255  # OpenCV's order is blue, green, red
    for _ in range(2000):
        writer.write(picture)
    writer.release()
    return path


def test_a_video_is_published_with_its_calibration(ros: RosSystem, video: Path) -> None:
    ros.serve_master()
    images, infos = Inbox(), Inbox()
    with Node("viewer", environment=Environment(master_uri=ros.master_uri)) as node:
        node.subscribe("/usb_cam/image_raw", Image, images)
        node.subscribe("/usb_cam/camera_info", CameraInfo, infos)
        camera = ros.pipros.start(
            "rosrun", "usb_cam", "usb_cam_node", f"_video_device:={video}", "_camera_frame_id:=lens"
        )
        camera.wait_for(r"Starting 'head_camera' \(\S+video.avi\) at 640x480 via OpenCV \(mjpeg\) at 30 FPS")
        wait_until(lambda: images.messages and infos.messages, 30, lambda: camera.output)
        image, info = images.messages[0], infos.messages[0]
        assert (image.width, image.height, image.encoding, image.step) == (WIDTH, HEIGHT, "rgb8", 3 * WIDTH)
        assert image.header.frame_id == info.header.frame_id == "lens"
        assert list(image.data[:3]) == pytest.approx([255, 0, 0], abs=3)
        assert (info.width, info.height) == (WIDTH, HEIGHT)
        for service in ("stop_capture", "start_capture"):
            assert ros.pipros.run("rosservice", "call", f"/usb_cam/{service}").returncode == 0
        seen = len(images.messages)
        wait_until(lambda: len(images.messages) > seen, 30, "another image")
        camera.press_ctrl_c()
        assert camera.wait() == 0


def test_a_missing_camera_and_an_unknown_format_are_errors(ros: RosSystem, video: Path) -> None:
    ros.serve_master()
    missing = ros.pipros.run("rosrun", "usb_cam", "usb_cam_node", "_video_device:=/dev/none")
    assert missing.returncode == 1
    assert "cannot open the camera /dev/none" in missing.output
    unknown = ros.pipros.run(
        "rosrun", "usb_cam", "usb_cam_node", f"_video_device:={video}", "_pixel_format:=h264"
    )
    assert unknown.returncode == 1
    assert (
        "pixel_format must be one of yuyv, uyvy, mjpeg, rgb24, grey, yuvmono10, got 'h264'" in unknown.output
    )


def test_the_node_ends_with_the_video(ros: RosSystem, video: Path) -> None:
    ros.serve_master()
    camera = ros.pipros.start(
        "rosrun", "usb_cam", "usb_cam_node", f"_video_device:={video}", "_framerate:=1000000"
    )
    camera.wait_for("cannot read an image from", 60)
    camera.wait()


def test_image_view_opens_the_page_at_its_topic(ros: RosSystem) -> None:
    ros.serve_master()
    for arguments, place in (
        (["image:=/usb_cam/image_raw"], "images/%2Fusb_cam%2Fimage_raw"),
        (
            ["image:=/cam", "_image_transport:=compressed", "_autosize:=true"],
            "images/%2Fcam%2Fcompressed",
        ),
    ):
        shown = ros.pipros.start("rosrun", "image_view", "image_view", "--no-browser", *arguments)
        assert Page.of(shown).place == place


def test_one_command_installs_all_that_the_node_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("usb_cam", "pipros_libraries.vision.capture"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    for name in ("numpy", "cv2"):
        monkeypatch.setitem(sys.modules, name, None)

    with pytest.raises(SystemExit, match=r"ERROR: usb_cam needs OpenCV, .*pip install .*\[vision\]"):
        runpy.run_path(str(SHARED_PACKAGES / "usb_cam" / "scripts" / "usb_cam_node"), run_name="__main__")
