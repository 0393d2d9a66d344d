"""Any scan, cloud, map and part of a map is used by a costmap, or refused with a ValueError.

The first byte of the input selects the type; the rest is the serialized message. Up to three messages follow
each other after a marker.

python -m tests.fuzz.costmap_inputs --seconds 60
"""

import struct
import sys
from contextlib import suppress
from functools import cache
from typing import Any

from pipros.msg import load_message_class
from pipros.msg.errors import DeserializationError
from pipros_robot.navigation.costmap.footprint import circle
from pipros_robot.navigation.costmap.inflation_layer import InflationLayer
from pipros_robot.navigation.costmap.layered import LayeredCostmap, Pose2D
from pipros_robot.navigation.costmap.observations import (
    ObservationSource,
    SourceSettings,
    cloud_points,
    old_cloud_points,
    scan_points,
)
from pipros_robot.navigation.costmap.obstacle_layer import ObstacleLayer
from pipros_robot.navigation.costmap.static_layer import StaticLayer, StaticSettings
from tests.fuzz import mutation

MARKER = b"\xa5\x5a\xa5\x5a"
TYPES = {
    0: "sensor_msgs/LaserScan", 1: "sensor_msgs/PointCloud2", 2: "sensor_msgs/PointCloud",
    3: "nav_msgs/OccupancyGrid", 4: "map_msgs/OccupancyGridUpdate",
}  # fmt: skip
READERS = {0: scan_points, 1: cloud_points, 2: old_cloud_points}
WORDS = [
    *(struct.pack("<f", value) for value in (float("nan"), float("inf"), -1.0, 0.0, 1e30, 1e-30, 0.05)),
    *(struct.pack("<d", value) for value in (float("nan"), float("inf"), -1e300, 1e300)),
    *(struct.pack("<I", value) for value in (0, 1, 2**31, 2**32 - 1, 65536)),
    *(bytes([kind]) for kind in TYPES),
    MARKER,
]
MOST_CELLS = 1_000_000
TURNED = (1.0, 0.5, 0.2, 0.0, 0.0, 0.6, 0.8)


@cache
def message_class(kind: int) -> Any:
    return load_message_class(TYPES[kind])


def messages(data: bytes) -> list[tuple[int, Any]]:
    found = []
    for part in data.split(MARKER)[:3]:
        if part and part[0] in TYPES:
            with suppress(DeserializationError):
                found.append((part[0], message_class(part[0])._from_bytes(part[1:])))
    return found


def target(data: bytes) -> None:
    costmap = LayeredCostmap()
    costmap.resize(40, 40, 0.1, -2.0, -2.0)
    fixed = StaticLayer("fixed", costmap, StaticSettings())
    seen = ObstacleLayer("seen", costmap, lambda: 0, tracks_unknown=True)
    source = ObservationSource(SourceSettings("any", clearing=True, observation_persistence=1.0))
    seen.sources.append(source)
    around = InflationLayer("around", costmap)
    costmap.layers += [fixed, seen, around]
    around.configure(radius=0.5, scaling=3.0, inflate_unknown=True)
    costmap.set_footprint(circle(0.2))
    for kind, message in messages(data):
        if len(getattr(message, "data", ())) > MOST_CELLS:
            continue
        with suppress(ValueError):
            if kind in READERS:
                points = READERS[kind](message)
                assert points.shape[1:] == (3,)
                source.add(points, TURNED, TURNED, 1, 2, 5000)
            elif kind == 3:
                fixed.set_map(message)
            else:
                fixed.set_part(message)
        costmap.update(Pose2D(0.3, -0.2, 1.0))
        assert costmap.grid.costs.shape == (costmap.grid.height, costmap.grid.width)
        assert sum(len(each.points) for each in source.observations()) <= max(5000, len(data))


if __name__ == "__main__":
    sys.exit(mutation.main(target, "costmap_inputs", WORDS))
