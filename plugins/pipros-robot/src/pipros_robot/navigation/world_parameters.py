"""Parameters for the nodes of a `NavigationWorld`, suited to a small, fast robot with a laser."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

_LAYERS: Final = {
    "robot_base_frame": "base_footprint",
    "transform_tolerance": 0.5,
    "robot_radius": 0.16,
    "obstacles": {
        "observation_sources": "scan",
        "obstacle_range": 3.0,
        "raytrace_range": 3.5,
        "scan": {"topic": "scan", "data_type": "LaserScan", "marking": True, "clearing": True},
    },
    "inflation": {"inflation_radius": 0.6, "cost_scaling_factor": 5.0},
}
_STATIC: Final = {"name": "static", "type": "costmap_2d::StaticLayer"}
_OBSTACLES: Final = {"name": "obstacles", "type": "costmap_2d::ObstacleLayer"}
_INFLATION: Final = {"name": "inflation", "type": "costmap_2d::InflationLayer"}

PARAMETERS: Final[Mapping[str, Any]] = {
    "amcl": {
        "base_frame_id": "base_footprint",
        "min_particles": 200,
        "max_particles": 10000,
        "kld_err": 0.02,
        "update_min_d": 0.2,
        "update_min_a": 0.5,
        "odom_alpha1": 0.1,
        "odom_alpha2": 0.1,
        "odom_alpha3": 0.1,
        "odom_alpha4": 0.1,
        "recovery_alpha_slow": 0.001,
        "recovery_alpha_fast": 0.1,
        "transform_tolerance": 0.3,
        "initial_cov_xx": 0.04,
        "initial_cov_yy": 0.04,
        "initial_cov_aa": 0.03,
    },
    "move_base": {
        "base_local_planner": "dwa_local_planner/DWAPlannerROS",
        "controller_frequency": 5.0,
        "planner_frequency": 1.0,
        "planner_patience": 5.0,
        "controller_patience": 15.0,
        "oscillation_timeout": 10.0,
        "oscillation_distance": 0.2,
        "global_costmap": {
            **_LAYERS,
            "global_frame": "map",
            "update_frequency": 2.0,
            "plugins": [_STATIC, _OBSTACLES, _INFLATION],
        },
        "local_costmap": {
            **_LAYERS,
            "global_frame": "odom",
            "rolling_window": True,
            "width": 3,
            "height": 3,
            "resolution": 0.05,
            "update_frequency": 5.0,
            "plugins": [_OBSTACLES, _INFLATION],
        },
        "DWAPlannerROS": {
            "max_vel_trans": 0.5,
            "max_vel_x": 0.5,
            "min_vel_x": -0.2,
            "max_vel_y": 0.0,
            "min_vel_y": 0.0,
            "min_vel_trans": 0.1,
            "max_vel_theta": 2.0,
            "min_vel_theta": 0.4,
            "acc_lim_y": 0.0,
            "xy_goal_tolerance": 0.1,
            "yaw_goal_tolerance": 0.1,
            "sim_time": 1.5,
            "vx_samples": 6,
            "vy_samples": 1,
            "vth_samples": 20,
            "path_distance_bias": 32.0,
            "goal_distance_bias": 20.0,
            "occdist_scale": 0.02,
        },
    },
}
"""Default parameters by node. The simulated robot is configured by `RobotSettings` instead."""


def merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested parameters with the changes applied."""
    result = dict(base)
    for name, value in changes.items():
        before = result.get(name)
        both = isinstance(before, Mapping) and isinstance(value, Mapping)
        result[name] = merged(before, value) if both else value  # type: ignore[arg-type]
    return result
