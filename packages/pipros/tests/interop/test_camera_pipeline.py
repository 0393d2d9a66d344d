"""A camera and a node that looks at its images, with the libraries of either side: cv_bridge, image_geometry,
message_filters."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAMS = Path(__file__).parent / "programs"
SIDES = ("pipros", "genuine")
PointStamped: Any = load_message_class("geometry_msgs/PointStamped")


@pytest.mark.timeout(300)
def test_images_of_either_side_are_detected_on_either_side(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()
    spots: dict[str, list[Any]] = {}
    environment = Environment(master_uri=plain_ros.pipros.environment["ROS_MASTER_URI"])
    with Node("listener", environment=environment) as node:
        for camera in SIDES:
            topics = [f"image_raw:=/{camera}/image_raw", f"camera_info:=/{camera}/camera_info"]
            getattr(plain_ros, camera).start("python3", PROGRAMS / "send_camera.py", *topics)
            for finder in SIDES:
                topic = f"/{camera}/seen_by_{finder}"
                spots[topic] = []
                node.subscribe(topic, PointStamped, spots[topic].append)
                spot = f"spot:={topic}"
                getattr(plain_ros, finder).start("python3", PROGRAMS / "find_spot.py", *topics, spot)

        for topic, found in spots.items():
            wait_until(partial(len, found), 120, f"a spot on {topic}")

    points = [found[0].point for found in spots.values()]
    for found in spots.values():
        assert found[0].header.frame_id == "camera_optical"
    expected = points[-1]  # the genuine result for the genuine camera
    assert 0.1 < expected.x < 0.3
    for point in points:
        assert (point.x, point.y, point.z) == pytest.approx((expected.x, expected.y, expected.z), abs=1e-9)
