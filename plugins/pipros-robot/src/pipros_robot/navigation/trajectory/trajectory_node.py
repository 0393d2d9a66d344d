"""The planner as part of a node, with the topics and parameters of TrajectoryPlannerROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from pipros_libraries.nodes.params import PrivateParameters, is_number
from pipros_robot.navigation.dwa.dwa_node import DwaLocalPlanner
from pipros_robot.navigation.dwa.goal_rotation import GoalRotation
from pipros_robot.navigation.trajectory.planner import TrajectoryPlanner
from pipros_robot.navigation.trajectory.settings import SETTINGS, TrajectorySettings

_OLD_NAMES: Final = {
    "max_rotational_vel": "max_vel_theta", "min_in_place_rotational_vel": "min_in_place_vel_theta",
    "pdist_scale": "path_distance_bias", "gdist_scale": "goal_distance_bias", "backup_vel": "escape_vel",
    "acc_lim_th": "acc_lim_theta", "vth_samples": "vtheta_samples",
}  # fmt: skip
"""Old and wrong names of parameters."""


class TrajectoryLocalPlanner(DwaLocalPlanner):
    """Follows plans in the local costmap. Not thread-safe, except for changes of the settings."""

    namespace = "~TrajectoryPlannerROS"
    settings = SETTINGS
    renamed: Mapping[str, str] = _OLD_NAMES
    magnitudes: Mapping[str, str] = {"min_in_place_vel_theta": "max_vel_theta"}
    has_samples = False
    _planner: TrajectoryPlanner

    def _prepare(self, given: PrivateParameters, period_s: float, is_latching: bool) -> None:
        left = given.values.get("max_vel_theta")
        if not given.has("min_vel_theta") and is_number(left):  # bound right turns like left turns
            self._node.params.set(f"{self.namespace}/min_vel_theta", -abs(left))
        self._fixed = {
            "sim_period": period_s,
            "xy_goal_tolerance": given.number("xy_goal_tolerance", 0.10),
            "yaw_goal_tolerance": given.number("yaw_goal_tolerance", 0.05),
            "prune_plan": given.boolean("prune_plan", True),
            "meter_scoring": given.boolean("meter_scoring", False),
            "min_turning_radius": self._radius(given),
        }
        if not given.has("meter_scoring"):
            self._log.warning("%s/meter_scoring is not set: distances are scored in cells", self.namespace)
        self._own = TrajectorySettings(**self._fixed)
        self._settings = self._own.shared
        self._planner = TrajectoryPlanner(self._own)
        is_latching = given.boolean("latch_xy_goal_tolerance", False)
        self._rotation = GoalRotation(self._settings, is_latching=is_latching, must_stand=False)

    def _make_settings(self, values: Mapping[str, Any]) -> Mapping[str, Any]:
        self._own = TrajectorySettings.of(values, **self._fixed)
        self._planner.use(self._own)
        self._settings = self._rotation.settings = self._own.shared
        return values

    def _values(self, names: Mapping[str, Any]) -> dict[str, Any]:
        return {name: getattr(self._own, name) for name in names}

    def greatest(self) -> tuple[float, float, float]:
        """Return the greatest speeds forwards and backwards in m/s, and of turns in rad/s."""
        own = self._own
        return own.max_vel_x, max(0.0, -own.escape_vel), max(own.max_vel_theta, -own.min_vel_theta)
