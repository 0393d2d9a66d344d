"""Points of scans and clouds, compared with plain loops; invalid ones are refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from pipros_robot.navigation.costmap.observations import cloud_points, old_cloud_points, scan_points
from tests.support.both_costmaps import cloud_message, scan_message


def test_valid_ranges_of_a_scan_become_points() -> None:
    numbers = np.random.default_rng(1)
    ranges = [*numbers.uniform(0.05, 12.0, 40), math.inf, -math.inf, math.nan, 0.1, 10.0, 0.0, -1.0]
    scan = scan_message(ranges, 1.0)
    scan.range_min, scan.range_max = 0.25, 8.0

    expected = [
        (distance * math.cos(angle), distance * math.sin(angle), 0.0)
        for index, distance in enumerate(scan.ranges)
        for angle in [scan.angle_min + index * scan.angle_increment]
        if 0.25 <= distance < 8.0
    ]
    assert scan_points(scan).tolist() == [pytest.approx(point, abs=1e-6) for point in expected]
    with_infinity = scan_points(scan, is_infinity_valid=True)
    assert len(with_infinity) == len(expected) + 1
    assert np.hypot(*with_infinity[:, :2].T).max() == pytest.approx(7.9999, abs=1e-5)


@pytest.mark.parametrize("angle", [math.nan, math.inf, 1e30])
def test_a_scan_with_impossible_angles_has_no_points_or_finite_ones(angle: float) -> None:
    scan = scan_message([1.0] * 5, 1.0)
    scan.angle_min = scan.angle_increment = angle
    assert np.isfinite(scan_points(scan)).all()


def test_points_of_clouds_are_read_wherever_their_fields_are() -> None:
    points = np.random.default_rng(2).uniform(-3, 3, (20, 3)).astype(np.float32)
    cloud = cloud_message(points, 1.0, "camera")
    assert np.array_equal(cloud_points(cloud), points)

    swapped = np.frombuffer(cloud.data, np.uint8).reshape(20, 14).copy()
    for offset in (0, 6, 10):
        swapped[:, offset : offset + 4] = swapped[:, offset : offset + 4][:, ::-1]
    cloud.data, cloud.is_bigendian = swapped.tobytes(), True
    assert np.array_equal(cloud_points(cloud), points)
    assert cloud_points(cloud_message(points[:0], 1.0, "camera")).shape == (0, 3)

    point_class: Any = load_message_class("geometry_msgs/Point32")
    old: Any = load_message_class("sensor_msgs/PointCloud")()
    assert old_cloud_points(old).shape == (0, 3)
    old.points = [point_class(*point) for point in points.tolist()]
    assert np.array_equal(old_cloud_points(old), points)


@pytest.mark.parametrize(("change", "complaint"), [
    ({"width": 2**32 - 1, "height": 2**32 - 1}, r"4294967295 \* 14 bytes, got 28"),
    ({"width": 3}, r"width \* height \* point_step = 3 \* 1 \* 14 bytes, got 28"),
    ({"point_step": 7, "width": 4}, "field x must .* lie within the point, got type 7 at offset"),
    ({"point_step": 0}, "bytes, got 28"),
    ({"fields": []}, "field x of a cloud must exist and be of type FLOAT32"),
])  # fmt: skip
def test_invalid_clouds_are_refused(change: dict[str, Any], complaint: str) -> None:
    cloud = cloud_message([(1, 2, 3), (4, 5, 6)], 1.0, "camera")
    for name, value in change.items():
        setattr(cloud, name, value)
    with pytest.raises(ValueError, match=complaint):
        cloud_points(cloud)
