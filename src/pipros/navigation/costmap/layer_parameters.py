"""The parameters of a costmap's layers: their names and types, old forms, and the settings of sources."""

from __future__ import annotations

import logging
from typing import Any, Final

from pipros.libraries.reconfiguring.server import Setting
from pipros.navigation.costmap.observations import SourceSettings
from pipros.navigation.costmap.sensor_input import DATA_TYPES
from pipros.navigation.parameters import InvalidParameter, Parameters, read_parameters, search_upwards
from pipros.node import Node

STATIC, OBSTACLE = "costmap_2d::StaticLayer", "costmap_2d::ObstacleLayer"
VOXEL, INFLATION = "costmap_2d::VoxelLayer", "costmap_2d::InflationLayer"

_ENABLED: Final = Setting("enabled", True, description="Whether the layer takes part")
_METHODS: Final = (
    "{'enum_description': 'How costs are combined with those of earlier layers', 'enum': ["
    "{'name': 'Overwrite', 'type': 'int', 'value': 0, 'description': 'Replace them'}, "
    "{'name': 'Maximum', 'type': 'int', 'value': 1, 'description': 'Take the greater one'}, "
    "{'name': 'Nothing', 'type': 'int', 'value': 99, 'description': 'Keep them'}]}"
)
_OBSTACLES: Final = (
    _ENABLED,
    Setting("footprint_clearing_enabled", True, description="Whether to free the cells under the robot"),
    Setting("max_obstacle_height", 2.0, 0, 50, "Height above which points do not mark, in metres"),
)

SETTINGS: Final[dict[str, tuple[Setting, ...]]] = {
    STATIC: (_ENABLED,),
    OBSTACLE: (
        *_OBSTACLES,
        Setting("combination_method", 1, description="How costs are combined", edit_method=_METHODS),
    ),
    VOXEL: (
        *_OBSTACLES,
        Setting("origin_z", 0.0, 0, None, "Height of the lowest voxel, in metres"),
        Setting("z_resolution", 0.2, 0, 50, "Height of a voxel, in metres"),
        Setting("z_voxels", 10, 0, 16, "Number of voxels above each other"),
        Setting("unknown_threshold", 15, 0, 16, "Number of unknown voxels in a known column, at most"),
        Setting("mark_threshold", 0, 0, 16, "Number of marked voxels in a free column, at most"),
        Setting("combination_method", 1, 0, 2, "How costs are combined", edit_method=_METHODS),
    ),
    INFLATION: (
        _ENABLED,
        Setting("cost_scaling_factor", 10.0, 0, 100, "How fast costs decrease with the distance, in 1/m"),
        Setting(
            "inflation_radius", 0.55, 0, 50, "Distance from obstacles up to which there are costs, in metres"
        ),
        Setting("inflate_unknown", False, description="Whether to raise the costs of unknown cells"),
    ),
}
"""The settings of each type of layer that clients can change."""

_VOXELS: Final = (
    "origin_z",
    "z_resolution",
    "z_voxels",
    "mark_threshold",
    "unknown_threshold",
    "publish_voxel_map",
)
_RANGES: Final = ("max_obstacle_height", "raytrace_range", "obstacle_range", "track_unknown_space")
_MAPS: Final = ("map_topic", "unknown_cost_value", "lethal_cost_threshold", "track_unknown_space")
_SHARED: Final = {
    STATIC: _MAPS,
    OBSTACLE: _RANGES,
    VOXEL: _VOXELS,
    INFLATION: ("cost_scaling_factor", "inflation_radius"),
}
"""Parameters of the costmap that each type of layer takes over."""


def layer_types(node: Node, costmap: str, log: logging.Logger) -> list[tuple[str, str]]:
    """Return names and types of the layers. Hand parameters of the costmap down to them.

    Without the parameter `plugins`, the list follows from `static_map` and `map_type`, as before ROS Hydro.

    Raises:
        InvalidParameter: `plugins` is not a list of names and types, or a type is unknown.
    """
    parameters = read_parameters(node, costmap)
    if not parameters.has("plugins"):
        log.warning("%s: there is no parameter plugins: the layers follow from the old parameters", costmap)
        return _old_layers(node, costmap, parameters)
    for name in ("static_map", "map_type"):
        if parameters.has(name):
            log.warning("%s/%s has no effect, because plugins is set", costmap, name)
    layers = []
    given = parameters.values["plugins"]
    for each in given if isinstance(given, list) else [given]:
        if not (isinstance(each, dict) and all(isinstance(each.get(key), str) for key in ("name", "type"))):
            raise InvalidParameter(
                f"{costmap}/plugins must be a list of {{name, type}}, got {str(each)[:200]}"
            )
        if each["type"] not in SETTINGS:
            raise InvalidParameter(
                f"{costmap}/plugins: {each['name']} has the type {each['type']}, which is not part of pipros "
                f"(layers in C++ cannot be loaded); there are {', '.join(SETTINGS)}"
            )
        layers.append((each["name"], each["type"]))
        for key in _SHARED[each["type"]]:
            if parameters.has(key):
                node.params.set(f"{costmap}/{each['name']}/{key}", parameters.values[key])
    return layers


def _old_layers(node: Node, costmap: str, parameters: Parameters) -> list[tuple[str, str]]:
    def move(layer: str, *names: str, keep: bool = False) -> None:
        for name in names:
            if parameters.has(name):
                node.params.set(f"{costmap}/{layer}/{name}", parameters.values[name])
                if not keep:
                    node.params.delete(f"{costmap}/{name}")

    layers = []
    if parameters.boolean("static_map", False):
        layers.append(("static_layer", STATIC))
        move("static_layer", *_MAPS[:3])
        move("static_layer", _MAPS[3], keep=True)
    is_voxel = parameters.text("map_type", "costmap") == "voxel"
    layers.append(("obstacle_layer", VOXEL if is_voxel else OBSTACLE))
    sources = parameters.text("observation_sources", "")
    move("obstacle_layer", *_RANGES, "observation_sources", *dict.fromkeys(sources.split()))
    if is_voxel:
        move("obstacle_layer", *_VOXELS)
    layers.append(("inflation_layer", INFLATION))
    move("inflation_layer", *_SHARED[INFLATION])
    node.params.set(f"{costmap}/plugins", [{"name": name, "type": kind} for name, kind in layers])
    return layers


def source_settings(node: Node, layer: str) -> list[SourceSettings]:
    """Read the observation sources of a layer, such as `~costmap/obstacle_layer`.

    Raises:
        InvalidParameter: a `data_type` is unknown.
    """
    names = read_parameters(node, layer).text("observation_sources", "").split()
    return [_source(node, f"{layer}/{name}", name) for name in names]


def _source(node: Node, namespace: str, name: str) -> SourceSettings:
    given = read_parameters(node, namespace)
    data_type = given.text("data_type", "PointCloud")
    if data_type not in DATA_TYPES:
        raise InvalidParameter(
            f"{namespace}/data_type must be one of {', '.join(DATA_TYPES)}, got {data_type}"
        )

    def searched(key: str, default: float) -> float:
        value: Any = search_upwards(node, namespace, key)
        return Parameters({key: value}).number(key, default)

    return SourceSettings(
        name,
        given.text("topic", name),
        data_type,
        given.text("sensor_frame", "").lstrip("/"),
        given.number("observation_persistence", 0.0),
        given.number("expected_update_rate", 0.0),
        given.number("min_obstacle_height", 0.0),
        given.number("max_obstacle_height", 2.0),
        given.boolean("inf_is_valid", False),
        given.boolean("marking", True),
        given.boolean("clearing", False),
        searched("obstacle_range", 2.5),
        searched("raytrace_range", 3.0),
    )
