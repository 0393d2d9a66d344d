"""The costmaps of both sides, cell by cell."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from tests.support.both_costmaps import both_costmaps, grid_message, scan_message
from tests.support.ros import RosSystem

SCAN = {
    "sensor_frame": "base_link",
    "data_type": "LaserScan",
    "topic": "/scan",
    "marking": True,
    "clearing": True,
}


def room(size: int = 80, seed: int = 3) -> Any:
    """Return the cells of a room with walls, boxes, unknown parts and grey cells."""
    numbers = np.random.default_rng(seed)
    cells = np.zeros((size, size + 13), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    for _ in range(12):
        x, y = numbers.integers(0, size, 2)
        cells[y : y + int(numbers.integers(1, 8)), x : x + int(numbers.integers(1, 8))] = 100
    cells[30:40, 5:15] = -1
    cells[50:60, 40:50] = numbers.integers(0, 101, (10, 10))
    return cells


def test_old_parameters_as_turtlebot3_uses_them(plain_ros: RosSystem) -> None:
    parameters = {
        "static_map": True, "map_type": "costmap", "obstacle_range": 3.0, "raytrace_range": 3.5,
        "footprint": [[-0.105, -0.105], [-0.105, 0.105], [0.041, 0.105], [0.041, -0.105]],
        "inflation_radius": 1.0, "cost_scaling_factor": 3.0, "observation_sources": "scan", "scan": SCAN,
    }  # fmt: skip
    numbers = np.random.default_rng(4)
    with both_costmaps(plain_ros, parameters, (2.0, 2.1, 0.3)) as both:
        both.publish("/map", grid_message(room(), 0.05, (-0.03, 0.02)))
        first = both.wait_until_equal()
        assert {100, 99, 0} <= set(np.unique(first).tolist())
        for _ in range(3):
            ranges = numbers.uniform(0.05, 4.5, 360)
            ranges[:20] = math.inf
            ranges[20:25] = math.nan
            scan = scan_message(ranges, time.time())
            both.wait_until_equal(lambda scan=scan: both.publish("/scan", scan))  # type: ignore[misc]
