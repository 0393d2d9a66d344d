"""The nodes for laser scans of both sides, on the same messages."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipros.libraries.clouds.points import cloud_of
from pipros.libraries.laser.cloud_to_scan_node import CloudToScanNode
from pipros.libraries.laser.depth_to_scan_node import DepthToScanNode
from pipros.msg import load_message_class
from tests.support.ros import RosSystem
from tests.support.small_nodes_oracle import add_to
from tests.support.twin_nodes import Twins, differences, twins

SCAN = {"scan": "sensor_msgs/LaserScan"}
TILTED = (0.1, -0.2, 0.3, 0.9)


def same(both: Twins, name: str, topic: str, count: int) -> bool:
    """Return True if both nodes have published equal messages; otherwise fail with the differences."""
    ours, genuine = both.outputs(name, topic, count)
    found = [differences(*pair) for pair in zip(ours, genuine, strict=True)]
    assert not any(found), f"{name}: {[each[:5] for each in found]}"
    return True


CLOUDS: dict[str, dict[str, Any]] = {
    "default": {},
    "narrow": {
        "min_height": -0.5, "max_height": 0.7, "range_min": 0.3, "range_max": 6.0,
        "angle_min": -1.5708, "angle_max": 1.5708, "angle_increment": 0.0087,
    },
    "finite": {"min_height": -1.0, "use_inf": False, "range_max": 5.0, "inf_epsilon": 2},
    "moved": {"target_frame": "base", "min_height": -1.0, "angle_increment": 0.0043633231, "scan_time": 1},
}  # fmt: skip


def test_clouds_become_the_same_scans(plain_ros: RosSystem) -> None:
    program = add_to(plain_ros.genuine) / "lib/pointcloud_to_laserscan/pointcloud_to_laserscan_node"
    numbers = np.random.default_rng(1)
    with twins(plain_ros) as both:
        for name, parameters in CLOUDS.items():
            both.add(name, CloudToScanNode, [program], parameters, {"cloud_in": "/cloud"}, SCAN)
        both.transforms(("base", "lidar", (0.3, -0.1, 0.5), TILTED))
        for count in range(1, 6):
            points = numbers.normal(0, 3, (5000, 3)).astype(np.float32)
            points[::97] = np.nan
            points[0] = 0
            both.publish(
                "/cloud", cloud_of(both.next_header("lidar"), dict(zip("xyz", points.T, strict=True)))
            )
            assert all(same(both, name, "scan", count) for name in CLOUDS)


DEPTHS: dict[str, dict[str, Any]] = {
    "default": {},
    "four_rows": {"scan_height": 4},
    "near": {"scan_height": 40, "range_min": 0.0, "range_max": 5.0, "output_frame_id": ""},
}


def depth_image(both: Twins, index: int, numbers: Any) -> tuple[Any, Any]:
    """Return a random depth image, and the information about its camera."""
    width, height = (64, 48) if index % 2 else (160, 120)
    depths = numbers.uniform(0.2, 12, (height, width)).astype(np.float32)
    missing = numbers.random(depths.shape)
    if index % 3 == 0:
        depths = np.where(missing < 0.2, 0, depths * 1000).astype(np.uint16)
    else:
        depths[missing < 0.2] = np.nan
        depths[missing > 0.9] = np.where(numbers.random((missing > 0.9).sum()) < 0.5, np.inf, -np.inf)
    header = both.next_header("camera")
    image: Any = load_message_class("sensor_msgs/Image")(header=header, height=height, width=width)
    image.encoding = "32FC1" if index % 3 else "16UC1"
    image.step, image.data = depths.strides[0], depths.tobytes()
    info: Any = load_message_class("sensor_msgs/CameraInfo")(header=header, height=height, width=width)
    info.distortion_model = "plumb_bob"
    focal, x, y = width * 0.9, width / 2 + numbers.normal(), height / 2 + numbers.normal()
    info.K, info.R = [focal, 0, x, 0, focal, y, 0, 0, 1], [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.D = [0.0] * 5 if index < 4 else [0.001, -0.0001, 0.0, 0.0, 0.0]
    info.P = [focal, 0, x, 0, 0, focal, y, 0, 0, 0, 1, 0]
    return image, info


def test_depth_images_become_the_same_scans(plain_ros: RosSystem) -> None:
    program = add_to(plain_ros.genuine) / "lib/depthimage_to_laserscan/depthimage_to_laserscan"
    numbers = np.random.default_rng(1)
    with twins(plain_ros) as both:
        inputs = {"image": "/cam/image"}
        for name, parameters in DEPTHS.items():
            both.add(name, DepthToScanNode, [program], parameters, inputs, SCAN)
        mine, his = both.settings("default")
        assert mine == his
        both.expect("/cam/camera_info", 2 * len(DEPTHS))
        for index in range(8):
            image, info = depth_image(both, index, numbers)
            both.publish("/cam/image", image)
            both.publish("/cam/camera_info", info)
        assert all(same(both, name, "scan", 8) for name in DEPTHS)
