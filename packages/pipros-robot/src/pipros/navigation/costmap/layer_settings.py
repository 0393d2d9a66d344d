"""The types of a costmap's layers, with the settings that clients can change."""

from __future__ import annotations

from typing import Final

from pipros.libraries.reconfiguring.server import Setting

STATIC, OBSTACLE = "costmap_2d::StaticLayer", "costmap_2d::ObstacleLayer"
VOXEL, INFLATION = "costmap_2d::VoxelLayer", "costmap_2d::InflationLayer"
_ENABLED: Final = Setting("enabled", True, description="Whether the layer is used")
_METHODS: Final = (
    "{'enum_description': 'How costs are combined with those of earlier layers', 'enum': ["
    "{'name': 'Overwrite', 'type': 'int', 'value': 0, 'description': 'Replace them'}, "
    "{'name': 'Maximum', 'type': 'int', 'value': 1, 'description': 'Take the greater one'}, "
    "{'name': 'Nothing', 'type': 'int', 'value': 99, 'description': 'Keep them'}]}"
)
_COMBINATION: Final = "combination_method", 1
_OBSTACLES: Final = (
    _ENABLED,
    Setting("footprint_clearing_enabled", True, description="Whether to free the cells under the robot"),
    Setting("max_obstacle_height", 2.0, 0, 50, "Height above which points do not mark, in metres"),
)
SETTINGS: Final[dict[str, tuple[Setting, ...]]] = {
    STATIC: (_ENABLED,),
    OBSTACLE: (*_OBSTACLES, Setting(*_COMBINATION, None, None, "How costs are combined", 0, _METHODS)),
    VOXEL: (
        *_OBSTACLES,
        Setting("origin_z", 0.0, 0, None, "Height of the lowest voxel, in metres"),
        Setting("z_resolution", 0.2, 0, 50, "Height of a voxel, in metres"),
        Setting("z_voxels", 10, 0, 16, "Number of voxels in a column"),
        Setting("unknown_threshold", 15, 0, 16, "Maximum number of unknown voxels in a known column"),
        Setting("mark_threshold", 0, 0, 16, "Maximum number of marked voxels in a free column"),
        Setting(*_COMBINATION, 0, 2, "How costs are combined", 0, _METHODS),
    ),
    INFLATION: (
        _ENABLED,
        Setting("cost_scaling_factor", 10.0, 0, 100, "How fast costs decrease with the distance, in 1/m"),
        Setting("inflation_radius", 0.55, 0, 50, "Distance from obstacles up to which costs are raised, m"),
        Setting("inflate_unknown", False, description="Whether to raise the costs of unknown cells"),
    ),
}
"""The settings of each type of layer that clients can change."""
