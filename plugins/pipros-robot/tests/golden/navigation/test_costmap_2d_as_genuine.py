"""Costmaps on recorded inputs, cell by cell beside the genuine ones."""

import math
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from tests.support.both_costmaps import BothCostmaps, both_costmaps
from tests.support.both_navigation import SIDES
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SCAN = {
    "sensor_frame": "base_link", "data_type": "LaserScan", "topic": "/scan", "marking": True,
    "clearing": True,
}  # fmt: skip
BURGER = [[-0.105, -0.105], [-0.105, 0.105], [0.041, 0.105], [0.041, -0.105]]


def change_settings(both: BothCostmaps, part: str, **values: Any) -> None:
    """Change settings, as rqt_reconfigure does."""
    config: Any = load_message_class("dynamic_reconfigure/Config")()
    for name, value in values.items():
        kind = "Bool" if isinstance(value, bool) else "Int" if isinstance(value, int) else "Double"
        parameter: Any = load_message_class(f"dynamic_reconfigure/{kind}Parameter")
        getattr(config, f"{kind.lower()}s").append(parameter(name, value))
    both.both.call(
        f"{both.both.name}/{part}/set_parameters", "dynamic_reconfigure/Reconfigure", config=config
    )


def described(message: Any) -> Any:
    """Return all of a description but its texts."""
    assert [group.name for group in message.groups] == ["Default"]
    names = [(each.name, each.type, each.level) for each in message.groups[0].parameters]
    values = [
        sorted(
            (each.name, each.value)
            for kind in ("bools", "ints", "strs", "doubles")
            for each in getattr(part, kind)
        )
        for part in (message.min, message.max, message.dflt)
    ]
    return names, values


def test_old_parameters_as_turtlebot3_has_them(ros: RosSystem, recording: Recording) -> None:
    parameters = {
        "static_map": True, "map_type": "costmap", "obstacle_range": 3.0, "raytrace_range": 3.5,
        "footprint": BURGER, "inflation_radius": 1.0, "cost_scaling_factor": 3, "observation_sources": "scan",
        "scan": SCAN, "width": 5.6, "transform_tolerance": 99.0, "update_frequency": 20,
    }  # fmt: skip
    with both_costmaps(ros, recording, parameters, (2.0, 2.1, 0.3)) as both:
        both.both.publish_next("map")
        first = both.wait_until_equal()
        assert {100, 99, 0} <= set(np.unique(first).tolist())
        for _ in range(3):
            both.wait_until_equal(lambda: both.observe("scan"))
        assert all(received.updates for received in both.received.values())

        ours, theirs = both.both.parameters()
        assert ours == theirs
        interfaces = [both.both.interface(side) for side in SIDES]
        for each in interfaces:
            each["subscriptions"].pop("/costmap_node/costmap/footprint", None)
        assert interfaces[0] == interfaces[1]
        for part in ("", "/static_layer", "/obstacle_layer", "/inflation_layer"):
            inboxes = both.both.inboxes(
                f"costmap_node/costmap{part}/parameter_descriptions", "dynamic_reconfigure/ConfigDescription"
            )
            assert described(inboxes["pipros"].wait(1)[0]) == described(inboxes["genuine"].wait(1)[0])


def test_a_rolling_window_with_clouds_and_a_turned_sensor(ros: RosSystem, recording: Recording) -> None:
    parameters = {
        "rolling_window": True, "width": 4, "height": 3, "resolution": 0.05, "track_unknown_space": True,
        "robot_radius": 0.17, "footprint_padding": 0.02,
        "plugins": [
            {"name": "fixed", "type": "costmap_2d::StaticLayer"},
            {"name": "seen", "type": "costmap_2d::ObstacleLayer"},
            {"name": "around", "type": "costmap_2d::InflationLayer"},
        ],
        "fixed": {"map_topic": "/map", "track_unknown_space": True},
        "seen": {
            "observation_sources": "points scan",
            "points": {
                "topic": "/points", "data_type": "PointCloud2", "marking": True, "clearing": True,
                "min_obstacle_height": 0.1, "max_obstacle_height": 1.2, "observation_persistence": 0.0,
                "obstacle_range": 1.4, "raytrace_range": 1.9,
            },
            "scan": {**SCAN, "marking": False, "inf_is_valid": True, "sensor_frame": "laser"},
        },
        "around": {"inflation_radius": 0.4, "cost_scaling_factor": 5.0, "inflate_unknown": True},
    }  # fmt: skip
    with both_costmaps(ros, recording, parameters, (1.5, 1.5, 0.0), topics=("map", "scan", "points")) as both:
        both.place(
            ("base_link", "camera", 0.1, 0.05, 0.4, 0.7), ("base_link", "laser", -0.2, 0.0, 0.3, math.pi)
        )
        both.both.publish_next("map")
        both.wait_until_equal()
        for x, y, yaw in ((1.62, 1.4, 0.4), (2.0, 1.85, 2.0), (1.31, 0.97, -1.0)):
            both.move_to(x, y, yaw)
            both.wait_until_equal(lambda: both.observe("points"))
            both.wait_until_equal(lambda: both.observe("scan"))


@pytest.mark.parametrize("is_rolling", [False, True])
def test_voxels_are_marked_and_cleared_at_their_heights(
    ros: RosSystem, recording: Recording, is_rolling: bool
) -> None:
    """All points are within the map: of rays that leave it, genuine's rounding errors drop some."""
    parameters = {
        "rolling_window": is_rolling, "width": 6, "height": 6, "origin_x": -1.5, "origin_y": -1.6,
        "robot_radius": 0.17, "track_unknown_space": True,
        "plugins": [{"name": "seen", "type": "costmap_2d::VoxelLayer"}],
        "seen": {
            "z_voxels": 8, "z_resolution": 0.15, "origin_z": 0.05, "max_obstacle_height": 1.1,
            "mark_threshold": 1, "unknown_threshold": 6, "publish_voxel_map": True,
            "observation_sources": "points",
            "points": {
                "topic": "/points", "data_type": "PointCloud2", "clearing": True, "obstacle_range": 1.6,
                "raytrace_range": 1.9, "max_obstacle_height": 3.0, "min_obstacle_height": -1.0,
            },
        },
    }  # fmt: skip
    with both_costmaps(ros, recording, parameters, (1.5, 1.5, 0.0), topics=("points",)) as both:
        both.place(("base_link", "camera", 0.1, 0.05, 0.4, 0.7))
        grids = both.both.inboxes("costmap_node/costmap/seen/voxel_grid", "costmap_2d/VoxelGrid")

        def columns() -> Any:
            message = grids["pipros"].messages[-1]
            size = message.size_x, message.size_y, message.size_z
            return [*size, message.origin.z, message.resolutions.z, list(message.data)]

        for x, y, yaw in ((1.62, 1.4, 0.4), (1.4, 1.3, -1.0)):
            both.move_to(x, y, yaw)
            for _ in range(2):
                cells = both.wait_until_equal(lambda: both.observe("points"))
                genuine = [*(voxels := recording.step("voxels"))[:-1], list(voxels[-1])]
                wait_until(lambda: columns() == genuine, 30, "equal voxels")  # noqa: B023
        assert {-1, 0, 100} <= set(cells.ravel().tolist())


def test_grey_maps_parts_of_maps_and_settings(ros: RosSystem, recording: Recording) -> None:
    parameters = {
        "track_unknown_space": True, "footprint_topic": "outline", "lethal_cost_threshold": 90,
        "plugins": [
            {"name": "fixed", "type": "costmap_2d::StaticLayer"},
            {"name": "seen", "type": "costmap_2d::ObstacleLayer"},
            {"name": "around", "type": "costmap_2d::InflationLayer"},
        ],
        "fixed": {"trinary_costmap": False, "subscribe_to_updates": True, "use_maximum": True},
        "seen": {"observation_sources": "scan", "scan": SCAN, "combination_method": 0},
    }  # fmt: skip
    numbers = np.random.default_rng(6)
    update_class: Any = load_message_class("map_msgs/OccupancyGridUpdate")
    polygon_class: Any = load_message_class("geometry_msgs/Polygon")
    point: Any = load_message_class("geometry_msgs/Point32")
    with both_costmaps(
        ros, recording, parameters, (2.0, 2.1, 0.3), topics=("map", "scan", "map_updates")
    ) as both:
        both.both.publish_next("map")
        both.wait_until_equal()
        data = numbers.integers(-1, 101, 200).tolist()
        update = update_class(x=60, y=5, width=20, height=10, data=data)
        both.wait_until_equal(lambda: both.both.publish("map_updates", update))
        outline = polygon_class([point(0.3, 0.2, 0), point(-0.1, 0.25, 0), point(-0.2, -0.3, 0)])
        both.wait_until_equal(
            lambda: both.both.publish("costmap_node/costmap/outline", outline, to="/pipros/")
        )
        both.wait_until_equal(lambda: both.observe("scan"))
        both.wait_until_equal(
            lambda: change_settings(both, "costmap/around", inflation_radius=0.8, cost_scaling_factor=2.5)
        )
        both.wait_until_equal(lambda: change_settings(both, "costmap/around", inflate_unknown=True))
        both.wait_until_equal(lambda: change_settings(both, "costmap", footprint_padding=0.1))
