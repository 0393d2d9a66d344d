"""The nodes for laser scans, on recorded messages: their scans equal those of the genuine nodes."""

from typing import Any

from pipros_robot.perception.laser.cloud_to_scan_node import CloudToScanNode
from pipros_robot.perception.laser.depth_to_scan_node import DepthToScanNode
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.twin_nodes import Twins, differences, twins

SCAN = {"scan": "sensor_msgs/LaserScan"}


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


def test_clouds_become_the_same_scans(ros: RosSystem, recording: Recording) -> None:
    program = ["pointcloud_to_laserscan", "pointcloud_to_laserscan_node"]
    with twins(ros, recording) as both:
        for name, parameters in CLOUDS.items():
            both.add(name, CloudToScanNode, program, parameters, {"cloud_in": "/cloud"}, SCAN)
        both.publish_next("/tf_static")
        for count in range(1, 6):
            both.publish_next("/cloud")
            assert all(same(both, name, "scan", count) for name in CLOUDS)


DEPTHS: dict[str, dict[str, Any]] = {
    "default": {},
    "four_rows": {"scan_height": 4},
    "near": {"scan_height": 40, "range_min": 0.0, "range_max": 5.0, "output_frame_id": ""},
}


def test_depth_images_become_the_same_scans(ros: RosSystem, recording: Recording) -> None:
    program = ["depthimage_to_laserscan", "depthimage_to_laserscan"]
    with twins(ros, recording) as both:
        inputs = {"image": "/cam/image"}
        for name, parameters in DEPTHS.items():
            both.add(name, DepthToScanNode, program, parameters, inputs, SCAN)
        mine, his = both.settings("default")
        assert mine == his
        both.expect("/cam/camera_info", len(DEPTHS))
        for _ in range(8):
            both.publish_next("/cam/image")
            both.publish_next("/cam/camera_info")
        assert all(same(both, name, "scan", 8) for name in DEPTHS)
