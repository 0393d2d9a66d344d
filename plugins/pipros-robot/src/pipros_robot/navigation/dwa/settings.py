"""The settings of the planner: names, defaults and ranges of dwa_local_planner's parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.nodes.velocities import check_axis
from pipros_libraries.reconfiguring.declared import settings_of, tunable

MAX_POSES: Final = 2_000_000
"""Maximum number of poses of all trajectories in a cycle: about 200 MB."""


@dataclass(frozen=True, slots=True)
class DwaSettings:
    """The reconfigurable parameters, by their ROS names, and three that are fixed at startup.

    Attributes:
        sim_period: period of the controller in seconds, for the window of velocities.
        sum_scores: whether the costs along a trajectory are added; otherwise, only the greatest cost counts.
        min_turning_radius: radius in metres below which the robot cannot turn, as a car; 0 for robots that
            turn in place. A car has reached the goal in any direction.
        cheat_factor: alignment is switched off if the squared distance to the goal is at most this factor
            times the squared `forward_point_distance`.
    """

    max_vel_trans: float = tunable(0.55, "Greatest speed, m/s", 0.0)
    min_vel_trans: float = tunable(0.1, "Least speed, m/s", 0.0)
    max_vel_x: float = tunable(0.55, "Greatest velocity forwards, m/s")
    min_vel_x: float = tunable(0.0, "Least velocity forwards, m/s; below 0: backwards")
    max_vel_y: float = tunable(0.1, "Greatest velocity to the left, m/s")
    min_vel_y: float = tunable(-0.1, "Least velocity to the left, m/s")
    max_vel_theta: float = tunable(1.0, "Greatest rate of turning, rad/s", 0.0)
    min_vel_theta: float = tunable(0.4, "Least rate of turning, rad/s", 0.0)
    acc_lim_x: float = tunable(2.5, "Acceleration forwards, m/s2", 0.0, 20.0)
    acc_lim_y: float = tunable(2.5, "Acceleration to the left, m/s2", 0.0, 20.0)
    acc_lim_theta: float = tunable(3.2, "Acceleration of turns, rad/s2", 0.0, 20.0)
    acc_lim_trans: float = tunable(0.1, "Has no effect", 0.0)
    prune_plan: bool = tunable(False, "Whether to drop the part of the plan behind the robot")
    xy_goal_tolerance: float = tunable(0.1, "Distance at which the goal is reached, m")
    yaw_goal_tolerance: float = tunable(0.1, "Angle at which the goal is reached, rad")
    trans_stopped_vel: float = tunable(0.1, "Speed up to which the robot counts as stopped, m/s")
    theta_stopped_vel: float = tunable(0.1, "Rate of turning up to which the robot counts as stopped, rad/s")
    sim_time: float = tunable(1.7, "Simulated time, s", 0.0)
    sim_granularity: float = tunable(0.025, "Distance between two poses, m", 0.0)
    angular_sim_granularity: float = tunable(0.1, "Angle between two poses, rad", 0.0)
    path_distance_bias: float = tunable(0.6, "Weight of the distance to the plan", 0.0)
    goal_distance_bias: float = tunable(0.8, "Weight of the distance to the local goal", 0.0)
    occdist_scale: float = tunable(0.01, "Weight of costs", 0.0)
    twirling_scale: float = tunable(0.0, "Weight of turning", 0.0)
    stop_time_buffer: float = tunable(0.2, "Has no effect", 0.0)
    oscillation_reset_dist: float = tunable(0.05, "Distance after which a direction is allowed again, m", 0.0)
    oscillation_reset_angle: float = tunable(0.2, "Angle after which a direction is allowed again, rad", 0.0)
    forward_point_distance: float = tunable(0.325, "Distance of the point ahead that follows the plan, m")
    scaling_speed: float = tunable(0.25, "Speed above which the footprint grows, m/s", 0.0)
    max_scaling_factor: float = tunable(0.2, "Growth of the footprint at full speed", 0.0)
    vx_samples: int = tunable(3, "Number of velocities along x", 1)
    vy_samples: int = tunable(10, "Number of velocities along y", 1)
    vth_samples: int = tunable(20, "Number of rates of turning", 1)
    use_dwa: bool = tunable(True, "Whether to try only velocities within reach in the next period")
    restore_defaults: bool = tunable(False, "Return to the settings at startup")
    sim_period: float = 0.05
    sum_scores: bool = False
    cheat_factor: float = 1.0
    min_turning_radius: float = 0.0

    @property
    def accelerations(self) -> tuple[float, float, float]:
        return self.acc_lim_x, self.acc_lim_y, self.acc_lim_theta

    @property
    def samples(self) -> tuple[int, int, int]:
        return self.vx_samples, self.vy_samples, self.vth_samples

    @classmethod
    def of(cls, values: Mapping[str, Any], **fixed: Any) -> DwaSettings:
        """Return the settings with these values.

        Raises:
            InvalidParameter: a value is huge, a divisor is not positive and finite, limits contradict each
                other (see `check_axis`), or a cycle would need too much memory.
        """
        settings = cls(**values, **fixed)
        for axis in ("x", "y", "theta", "trans"):
            least, most, gain = (
                (name, getattr(settings, name))
                for name in (f"min_vel_{axis}", f"max_vel_{axis}", f"acc_lim_{axis}")
            )
            is_magnitude = axis in ("theta", "trans")
            if is_magnitude and not most[1]:
                least = least[0], min(least[1], 0.0)  # 0 switches it off
            check_axis(least, most, None if axis == "trans" else gain)
        for name, value in values.items():
            if not abs(value) <= 1e9:  # an infinite weight would make all scores alike
                raise InvalidParameter(f"{name} must be from -1e9 to 1e9, got {value:g}")
        if settings.min_turning_radius:
            settings = replace(settings, yaw_goal_tolerance=math.pi)
        for name in ("sim_time", "sim_granularity", "angular_sim_granularity"):
            if not 0 < getattr(settings, name) < math.inf:
                raise InvalidParameter(f"{name} must be > 0 and finite, got {getattr(settings, name)}")
        speed = max(settings.max_vel_trans / settings.sim_granularity, 0.0)
        turn = settings.max_vel_theta / settings.angular_sim_granularity
        poses = math.prod(settings.samples) * max(speed, turn, 1.0) * settings.sim_time
        if not poses <= MAX_POSES:
            raise InvalidParameter(
                f"the samples, sim_time and the granularities result in {poses:.3g} poses; "
                f"at most {MAX_POSES:,} are allowed"
            )
        return settings


SETTINGS: Final = settings_of(DwaSettings)
"""The reconfigurable parameters, in the order of the genuine description."""
