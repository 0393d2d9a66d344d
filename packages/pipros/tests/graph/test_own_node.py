"""Nodes of docs/guides/libraries.md: the test of one passes, and they run as programs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage

from cv_bridge import CvBridge
from pipros import Environment, Node
from pipros.msg import load_message_class
from tests.support import documents
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.ros import RosSystem
from tests.tutorial.test_docs import BLOCK

BLOCKS = BLOCK.findall(documents.text_of("guides/libraries.md"))
FILES = {title: content for _, title, content in BLOCKS if title.endswith("nearest.py")}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, content in FILES.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    return tmp_path


def test_the_example_is_short_and_its_test_passes(folder: Path) -> None:
    assert sum(bool(line) for content in FILES.values() for line in content.splitlines()) <= 30
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_nearest.py"]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True)

    assert "1 passed" in ended.stdout, ended.stdout + ended.stderr


def test_the_example_is_a_program(folder: Path, ros: RosSystem) -> None:
    ros.serve_master()
    node = ros.pipros.start("python3", folder / "nearest.py", "_limit:=1")
    ros.wait_for_subscriber("/scan")
    scan = "{range_min: 0.5, ranges: [2.0, 0.1, 0.75], header: {frame_id: laser}}"
    ros.pipros.start("rostopic", "pub", "-r", "10", "scan", "sensor_msgs/LaserScan", scan)
    echo = ros.pipros.run("rostopic", "echo", "-n", "1", "nearest")

    assert "range: 0.75" in echo.output
    node.press_ctrl_c()
    assert node.wait() == 0


def test_the_example_halves_compressed_images(ros: RosSystem) -> None:
    (code,) = (content for _, title, content in BLOCKS if title == "shrink.py")
    (ros.home / "shrink.py").write_text(code)
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:] = (200, 100, 50)
    whole = CvBridge().cv2_to_compressed_imgmsg(picture, "png")
    ros.serve_master()
    inbox = Inbox()
    with Node("camera", environment=Environment(master_uri=ros.master_uri)) as camera:
        camera.subscribe("/camera/small/compressed", CompressedImage, inbox)
        camera.advertise("/camera/image_raw/compressed", CompressedImage, latch=True).publish(whole)
        ros.pipros.start("python3", ros.home / "shrink.py")
        small = CvBridge().compressed_imgmsg_to_cv2(inbox.wait()[0], "bgr8")
    assert small.shape == (24, 32, 3)
    assert np.abs(small.astype(int) - (200, 100, 50)).max() <= 4


def test_the_nodelet_publishes_the_mean_of_each_image(make_node: MakeNode) -> None:
    (code,) = (content for _, _, content in BLOCKS if "class Brightness" in content)
    names: dict[str, Any] = {
        each: load_message_class(f"{package}/{each}")
        for package, each in (("std_msgs", "Float32"), ("sensor_msgs", "Image"))
    }
    exec(code, names)  # noqa: S102 # our own document
    nodelet = names["Brightness"](make_node("brightness"))
    inbox = Inbox()
    wait_until_connected(make_node("reader").subscribe("/brightness/mean", names["Float32"], inbox))

    make_node("camera").advertise("image", names["Image"], latch=True).publish(names["Image"](data=b"\1\3"))

    assert inbox.wait()[0].data == 2.0
    nodelet.close()
