"""The settings of TrajectoryPlannerROS: names, defaults and ranges of base_local_planner's parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.nodes.velocities import check_axis
from pipros_libraries.reconfiguring.declared import settings_of, tunable
from pipros_robot.navigation.dwa.settings import DwaSettings

STOPPED: Final = 0.01
"""Speed in m/s and rad/s up to which the robot counts as stopped."""
_MOST_STRAFES: Final = 100


@dataclass(frozen=True, slots=True)
class TrajectorySettings:
    """The reconfigurable parameters, by their ROS names, and those that are fixed at startup.

    Attributes:
        sim_period: period of the controller in seconds.
        xy_goal_tolerance, yaw_goal_tolerance: tolerances at the goal, in metres and radians.
        prune_plan: whether the part of the plan behind the robot is dropped.
        meter_scoring: whether all three weights are multiplied by the resolution of the costmap.
    """

    acc_lim_x: float = tunable(2.5, "Acceleration forwards, m/s2", 0.0, 20.0)
    acc_lim_y: float = tunable(2.5, "Acceleration to the left, m/s2", 0.0, 20.0)
    acc_lim_theta: float = tunable(3.2, "Acceleration of turns, rad/s2", 0.0, 20.0)
    max_vel_x: float = tunable(0.55, "Greatest velocity forwards, m/s", 0.0, 20.0)
    min_vel_x: float = tunable(0.0, "Least velocity forwards, m/s", 0.0, 20.0)
    max_vel_theta: float = tunable(1.0, "Greatest rate of turning to the left, rad/s", 0.0, 20.0)
    min_vel_theta: float = tunable(-1.0, "Greatest rate of turning to the right, rad/s", -20.0, 0.0)
    min_in_place_vel_theta: float = tunable(0.4, "Least rate of turning in place, rad/s", 0.0, 20.0)
    sim_time: float = tunable(1.7, "Simulated time, s", 0.0, 10.0)
    sim_granularity: float = tunable(0.025, "Distance between two poses, m", 0.0, 5.0)
    angular_sim_granularity: float = tunable(0.025, "Angle between two poses, rad", 0.0, math.pi / 2)
    path_distance_bias: float = tunable(0.6, "Weight of the distance to the plan", 0.0, 5.0)
    goal_distance_bias: float = tunable(0.8, "Weight of the distance to the local goal", 0.0, 5.0)
    occdist_scale: float = tunable(0.01, "Weight of costs", 0.0, 5.0)
    oscillation_reset_dist: float = tunable(0.05, "Distance that ends a ban of a direction, m", 0.0, 5.0)
    escape_reset_dist: float = tunable(0.1, "Distance that ends an escape, m", 0.0, 5.0)
    escape_reset_theta: float = tunable(math.pi / 2, "Angle that ends an escape, rad", 0.0, 5.0)
    vx_samples: int = tunable(20, "Number of velocities along x", 1, 300)
    vtheta_samples: int = tunable(20, "Number of rates of turning", 1, 300)
    heading_lookahead: float = tunable(0.325, "Distance of the point that chooses a turn in place, m", 0, 5)
    holonomic_robot: bool = tunable(True, "Whether the robot can move sideways")
    escape_vel: float = tunable(-0.1, "Velocity of an escape, m/s; below 0: backwards", -2.0, 2.0)
    dwa: bool = tunable(False, "Whether to try only velocities within reach in the next period")
    heading_scoring: bool = tunable(False, "Whether to score the direction to the plan, not the distance")
    heading_scoring_timestep: float = tunable(0.1, "Time after which the direction is scored, s", 0.0, 1.0)
    simple_attractor: bool = tunable(False, "Whether to score only the straight distance to the goal")
    y_vels: str = tunable("-0.3,-0.1,0.1,-0.3", "Velocities sideways, m/s, separated by commas")
    restore_defaults: bool = tunable(False, "Return to the settings at startup")
    sim_period: float = 0.05
    xy_goal_tolerance: float = 0.10
    yaw_goal_tolerance: float = 0.05
    prune_plan: bool = True
    meter_scoring: bool = False
    min_turning_radius: float = 0.0

    @property
    def strafes(self) -> list[float]:
        """The velocities sideways.

        Raises:
            InvalidParameter: `y_vels` is not a list of at most 100 finite numbers.
        """
        try:
            found = [float(each) for each in self.y_vels.split(",") if each.strip()]
        except ValueError:
            found = [math.nan]
        if len(found) > _MOST_STRAFES or not all(map(math.isfinite, found)):
            raise InvalidParameter(f"y_vels must be numbers separated by commas, got {self.y_vels[:200]!r}")
        return found

    @property
    def shared(self) -> DwaSettings:
        """These settings as those of the sampling that both planners use.

        Raises:
            InvalidParameter: a setting is invalid.
        """
        sideways = max(map(abs, self.strafes), default=0.0) if self.holonomic_robot else 0.0
        fastest = max(self.max_vel_x, sideways, abs(self.escape_vel)) + 0.1
        values = {name: getattr(self, name) for name in _SAME}
        turn = min(self.max_vel_theta, -self.min_vel_theta)
        return DwaSettings.of(
            values,
            max_vel_trans=math.hypot(fastest, sideways), min_vel_trans=0.0, max_vel_y=sideways,
            min_vel_y=-sideways, max_vel_theta=turn,
            min_vel_theta=min(self.min_in_place_vel_theta, turn), vth_samples=self.vtheta_samples,
            vy_samples=1, trans_stopped_vel=STOPPED, theta_stopped_vel=STOPPED,
            oscillation_reset_angle=math.inf, use_dwa=False, max_scaling_factor=0.0,
            forward_point_distance=0.0,
        )  # fmt: skip

    @classmethod
    def of(cls, values: Mapping[str, Any], **fixed: Any) -> TrajectorySettings:
        """Return the settings with these values. Raises the errors of `shared`."""
        settings = cls(**values, **fixed)
        fastest = max(settings.max_vel_theta, -settings.min_vel_theta)
        slowest = settings.min_in_place_vel_theta if fastest else 0.0
        check_axis(("min_in_place_vel_theta", slowest), ("max_vel_theta", fastest))
        _ = settings.shared
        return settings


_SAME: Final = (
    "acc_lim_x", "acc_lim_y", "acc_lim_theta", "max_vel_x", "min_vel_x", "prune_plan", "xy_goal_tolerance",
    "yaw_goal_tolerance", "sim_time", "sim_granularity", "angular_sim_granularity", "path_distance_bias",
    "goal_distance_bias", "occdist_scale", "oscillation_reset_dist", "vx_samples", "sim_period",
    "min_turning_radius",
)  # fmt: skip
SETTINGS: Final = settings_of(TrajectorySettings)
"""The reconfigurable parameters, in the order of the genuine description."""
