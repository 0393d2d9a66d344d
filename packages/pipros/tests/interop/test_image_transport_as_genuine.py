"""image_transport compared with the genuine one, and images of OpenCV with those of Pillow."""

from __future__ import annotations

import base64
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pictures

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_libraries.pictures.codecs import PillowCodec
from pipros_libraries.vision.compressed_images import decompressed
from tests.support.environments import SOURCE_PATH
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "compress_by_opencv.py"
Image: Any = load_message_class("sensor_msgs/Image")


@pytest.mark.parametrize("out_transport", [["raw"], []])
def test_raw_images_are_forwarded_as_by_genuine(plain_ros: RosSystem, out_transport: list[str]) -> None:
    plain_ros.serve_master()
    got: dict[str, list[AnyMsg]] = {"genuine": [], "pipros": []}
    environment = Environment(master_uri=plain_ros.pipros.environment["ROS_MASTER_URI"])
    with Node("camera", environment=environment) as node:
        publisher = node.advertise("/camera/image", Image, queue_size=1)
        for side, messages in got.items():
            node.subscribe(f"/{side}", AnyMsg, messages.append)
            arguments = ("raw", "in:=/camera/image", *out_transport, f"out:=/{side}")
            getattr(plain_ros, side).start_node("image_transport", "republish", *arguments)
        image = Image(height=2, width=3, encoding="rgb8", step=9, data=bytes(range(18)))
        image.header.frame_id = "camera"

        def arrived() -> bool:
            publisher.publish(image)
            return all(got.values())

        wait_until(arrived, 60, "an image of either side")

    genuine, ours = (messages[0] for messages in got.values())
    assert ours.header["type"] == genuine.header["type"] == "sensor_msgs/Image"
    assert ours.header["md5sum"] == genuine.header["md5sum"]
    # The first field is the number of the message.
    assert ours.body[4:] == genuine.body[4:]


def test_pillow_reads_what_opencv_compressed() -> None:
    ended = subprocess.run(
        ["/usr/bin/python3", PROGRAM],
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": SOURCE_PATH},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr

    for name, (kind, data, image) in json.loads(ended.stdout).items():
        ours, _ = decompressed(kind, base64.b64decode(data), PillowCodec(Pictures))
        # JPEG values may differ by rounding errors.
        limit = 0 if "png" in kind else 4
        assert np.abs(ours.astype(int) - np.array(image)).max() <= limit * (256 if "16;" in name else 1), name
