"""The settings of the planner: names, defaults and ranges of dwa_local_planner's parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

from pipros.libraries.reconfiguring.server import Setting
from pipros.navigation.parameters import InvalidParameter

MAX_POSES: Final = 2_000_000
"""Maximum number of poses of all ways in a cycle: some 200 MB."""


@dataclass(frozen=True, slots=True)
class DwaSettings:
    """The reconfigurable parameters, by their names in ROS, and three that are fixed at the start.

    Attributes:
        sim_period: period of the controller in seconds, for the window of velocities.
        sum_scores: whether the costs under a way are summed up; otherwise the greatest counts.
        cheat_factor: factor of the squared distance to the goal at which the alignment ends.
    """

    max_vel_trans: float = 0.55
    min_vel_trans: float = 0.1
    max_vel_x: float = 0.55
    min_vel_x: float = 0.0
    max_vel_y: float = 0.1
    min_vel_y: float = -0.1
    max_vel_theta: float = 1.0
    min_vel_theta: float = 0.4
    acc_lim_x: float = 2.5
    acc_lim_y: float = 2.5
    acc_lim_theta: float = 3.2
    acc_lim_trans: float = 0.1
    prune_plan: bool = False
    xy_goal_tolerance: float = 0.1
    yaw_goal_tolerance: float = 0.1
    trans_stopped_vel: float = 0.1
    theta_stopped_vel: float = 0.1
    sim_time: float = 1.7
    sim_granularity: float = 0.025
    angular_sim_granularity: float = 0.1
    path_distance_bias: float = 0.6
    goal_distance_bias: float = 0.8
    occdist_scale: float = 0.01
    twirling_scale: float = 0.0
    stop_time_buffer: float = 0.2
    oscillation_reset_dist: float = 0.05
    oscillation_reset_angle: float = 0.2
    forward_point_distance: float = 0.325
    scaling_speed: float = 0.25
    max_scaling_factor: float = 0.2
    vx_samples: int = 3
    vy_samples: int = 10
    vth_samples: int = 20
    use_dwa: bool = True
    sim_period: float = 0.05
    sum_scores: bool = False
    cheat_factor: float = 1.0

    @property
    def accelerations(self) -> tuple[float, float, float]:
        return self.acc_lim_x, self.acc_lim_y, self.acc_lim_theta

    @property
    def samples(self) -> tuple[int, int, int]:
        return self.vx_samples, self.vy_samples, self.vth_samples

    @classmethod
    def of(cls, values: Mapping[str, Any], **fixed: Any) -> DwaSettings:
        """Return the settings with these values; names that are not settings are ignored.

        Raises:
            InvalidParameter: a divisor is 0, or a cycle would need too much memory.
        """
        known = {each.name for each in fields(cls)}
        settings = cls(**{name: value for name, value in values.items() if name in known}, **fixed)
        for name in ("sim_time", "sim_granularity", "angular_sim_granularity"):
            if not 0 < getattr(settings, name) < math.inf:
                raise InvalidParameter(f"{name} must be > 0 and finite, got {getattr(settings, name)}")
        speed = max(settings.max_vel_trans / settings.sim_granularity, 0.0)
        turn = settings.max_vel_theta / settings.angular_sim_granularity
        poses = math.prod(settings.samples) * max(speed, turn, 1.0) * settings.sim_time
        if not poses <= MAX_POSES:
            raise InvalidParameter(
                f"the samples, sim_time and the granularities make {poses:.3g} poses; "
                f"at most {MAX_POSES:,} are allowed"
            )
        return settings


_WITHOUT_RANGE: Final = (
    "max_vel_x", "min_vel_x", "max_vel_y", "min_vel_y", "xy_goal_tolerance", "yaw_goal_tolerance",
    "trans_stopped_vel", "theta_stopped_vel", "forward_point_distance",
)  # fmt: skip
_FIXED: Final = ("sim_period", "sum_scores", "cheat_factor")
_UNITS: Final = {
    "vel": "m/s or rad/s", "lim": "m/s2 or rad/s2", "tolerance": "m or rad", "time": "s",
    "granularity": "m or rad", "dist": "m", "distance": "m", "angle": "rad", "speed": "m/s",
}  # fmt: skip


def _settings() -> Iterator[Setting]:
    for each in fields(DwaSettings):
        value: Any = each.default
        if each.name in _FIXED:
            continue
        low: float | None = None
        if not isinstance(value, bool) and each.name not in _WITHOUT_RANGE:
            low = 1 if isinstance(value, int) else 0.0
        high = 20.0 if each.name in ("acc_lim_x", "acc_lim_y", "acc_lim_theta") else None
        text = each.name.replace("_", " ")
        unit = next((unit for word, unit in _UNITS.items() if word in each.name.split("_")), "")
        yield Setting(each.name, value, low, high, f"{text}, {unit}" if unit else text)
    yield Setting("restore_defaults", False, description="return to the settings of the start")


SETTINGS: Final = tuple(_settings())
"""The reconfigurable parameters, in the order of genuine's description."""
