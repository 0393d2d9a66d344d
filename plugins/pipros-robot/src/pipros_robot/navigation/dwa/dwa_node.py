"""The planner as part of a node, with topics and parameters, like DWAPlannerROS of dwa_local_planner."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.nodes.params import (
    InvalidParameter,
    PrivateParameters,
    is_number,
    read_parameters,
    search_upwards,
)
from pipros_libraries.nodes.velocities import check_settings
from pipros_libraries.nodes.wiring import advertise, subscribe
from pipros_libraries.reconfiguring.server import Reconfigurable
from pipros_libraries.transforms.errors import TransformException
from pipros_robot.navigation import plane
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.costmap.grid import INSCRIBED
from pipros_robot.navigation.dwa.goal_rotation import STILL, GoalRotation
from pipros_robot.navigation.dwa.planner import Choice, DwaPlanner
from pipros_robot.navigation.dwa.settings import SETTINGS, DwaSettings
from pipros_robot.navigation.plane import Poses, Triple

_NEAR_M: Final = 1.0
"""With `prune_plan`, poses before the first pose closer to the robot than this are dropped."""
_CLOUD: Final = "sensor_msgs/PointCloud2"
_RENAMED: Final = {
    "max_trans_vel": "max_vel_trans", "min_trans_vel": "min_vel_trans", "max_rot_vel": "max_vel_theta",
    "min_rot_vel": "min_vel_theta", "acc_limit_trans": "acc_lim_trans",
    "rot_stopped_vel": "theta_stopped_vel", "vtheta_samples": "vth_samples", "acc_lim_th": "acc_lim_theta",
    "latch_xy_goal_tolerance": "~latch_xy_goal_tolerance",
}  # fmt: skip


class DwaLocalPlanner:
    """Follows plans in the local costmap. Not thread-safe, except for changes of the settings."""

    namespace = "~DWAPlannerROS"
    settings = SETTINGS
    renamed: Mapping[str, str] = _RENAMED
    magnitudes: Mapping[str, str] = {"min_vel_trans": "max_vel_trans", "min_vel_theta": "max_vel_theta"}
    has_samples = True

    def __init__(self, node: Node, log: logging.Logger, costmap: Costmap) -> None:
        """Register the topics and the settings in the namespace `~DWAPlannerROS`."""
        self._node, self._log, self._costmap, namespace = node, log, costmap, self.namespace
        self._use_old_names()
        given = read_parameters(node, namespace)
        frequency = search_upwards(node, namespace, "controller_frequency")
        period_s = 1.0 / frequency if isinstance(frequency, int | float) and frequency > 0 else 0.05
        is_latching = read_parameters(node, "~").boolean("latch_xy_goal_tolerance", False)
        self._prepare(given, period_s, is_latching)
        self._plan_frame, self._plan = costmap.global_frame, np.empty((0, 3))
        self._velocity: Triple = STILL
        self._global_plan, self._local_plan, self._costs = (
            advertise(node, f"{namespace}/{name}", kind)
            for name, kind in (("global_plan", "nav_msgs/Path"), ("local_plan", "nav_msgs/Path"),
                               ("cost_cloud", _CLOUD))
        )  # fmt: skip
        self._tried = advertise(node, f"{namespace}/trajectory_cloud", _CLOUD) if self.has_samples else None
        self._shows_tried = given.boolean("publish_traj_pc", False)
        self._shows_costs = given.boolean("publish_cost_grid_pc", False)
        self._cloud_frame = given.text("global_frame_id", "odom")
        self._has_started = False
        check_settings(node, namespace, self.settings)
        Reconfigurable(node, namespace, self.settings, self._apply)
        self._has_started = True
        subscribe(node, given.text("odom_topic", "odom"), "nav_msgs/Odometry", self._on_odometry)

    def _use_old_names(self) -> None:
        """Store values under their present names, so that no limit is lost, unless these are set, too.

        Defaults of the least magnitudes do not exceed the greatest ones that are set.
        """
        values = dict(read_parameters(self._node, self.namespace).values)
        for old, new in self.renamed.items():
            if old in values:
                is_used = not (new in values or new.startswith("~"))
                effect = "is used" if is_used else "has no effect"
                self._log.warning("%s/%s %s: the name is %s", self.namespace, old, effect, new)
                if is_used:
                    values[new] = values[old]
                    self._node.params.set(f"{self.namespace}/{new}", values[old])
        usual = {each.name: each.default for each in self.settings}
        for least, most in self.magnitudes.items():
            greatest = values.get(most)
            if least not in values and is_number(greatest) and 0 <= greatest < float(usual[least]):
                self._node.params.set(f"{self.namespace}/{least}", float(greatest))

    def _prepare(self, given: PrivateParameters, period_s: float, is_latching: bool) -> None:
        """Create the planner and the rotation, with the parameters that are fixed at startup."""
        self._fixed: dict[str, Any] = {
            "sim_period": period_s,
            "sum_scores": given.boolean("sum_scores", False),
            "cheat_factor": given.number("cheat_factor", 1.0),
            "min_turning_radius": self._radius(given),
        }
        self._settings = DwaSettings(**self._fixed)
        self._planner = DwaPlanner(self._settings)
        self._rotation = GoalRotation(self._settings, is_latching=is_latching)

    def _radius(self, given: PrivateParameters) -> float:
        radius = given.number("min_turning_radius", 0.0)
        if not 0 <= radius < math.inf:
            place = f"{self.namespace}/min_turning_radius"
            raise InvalidParameter(f"{place} must be >= 0 and finite, got {radius}")
        return radius

    @property
    def turning_radius(self) -> float:
        """Least radius of turns in metres; 0 if the robot can turn in place."""
        return self._settings.min_turning_radius

    def _apply(self, values: Mapping[str, Any], _: int) -> Mapping[str, Any]:
        try:
            return self._make_settings(values)
        except InvalidParameter as error:
            if not self._has_started:  # there are no settings to keep, and the defaults may be too fast
                raise InvalidParameter(f"{self.namespace}/{error}") from None
            self._log.error("the settings of the local planner are not changed: %s", error)
            return self._values(values)

    def _make_settings(self, values: Mapping[str, Any]) -> Mapping[str, Any]:
        settings = DwaSettings.of(values, **self._fixed)
        self._settings = self._planner.settings = self._rotation.settings = settings
        return values

    def _values(self, names: Mapping[str, Any]) -> dict[str, Any]:
        return {name: getattr(self._settings, name) for name in names}

    def greatest(self) -> tuple[float, float, float]:
        """Return the greatest speeds forwards and backwards in m/s, and of turns in rad/s."""
        settings = self._settings
        backwards = min(settings.max_vel_trans, max(0.0, -settings.min_vel_x))
        return min(settings.max_vel_trans, settings.max_vel_x), backwards, settings.max_vel_theta

    def limited(self, velocity: Triple) -> Triple:
        """Return a velocity within the limits, which a measured velocity may exceed."""
        (forwards, backwards, turn), side = self.greatest(), self._settings
        x, y, rate = velocity
        return (
            min(max(x, -backwards), forwards),
            min(max(y, side.min_vel_y), side.max_vel_y) if y else y,
            min(max(rate, -turn), turn),
        )

    def too_coarse(self) -> Iterator[str]:
        """Yield the tolerances at the goal that the least velocities step over in one period."""
        shared = self._settings
        for name, least, tolerance in (
            ("yaw_goal_tolerance", shared.min_vel_theta, shared.yaw_goal_tolerance),
            ("xy_goal_tolerance", shared.min_vel_trans, shared.xy_goal_tolerance),
        ):
            if least * shared.sim_period > 2 * tolerance:
                reason = f"in one period of {shared.sim_period:g} s, the least velocity, {least:g}, passes it"
                yield f"{name} is {tolerance:g}, and the robot may not come to rest within it: {reason}"

    @property
    def fastest_turn(self) -> float:
        """Greatest rate of turning in place in rad/s; 0 for a car."""
        return 0.0 if self.turning_radius else self.greatest()[2]

    def _on_odometry(self, message: Any) -> None:
        rates = message.twist.twist
        self._velocity = rates.linear.x, rates.linear.y, rates.angular.z

    # -- called by move_base -----------------------------------------------------

    def take_plan(self, other: DwaLocalPlanner) -> None:
        """Follow the plan of a planner that this one replaces."""
        self.set_plan(other._plan_frame, other._plan)

    def set_plan(self, frame: str, poses: Poses) -> bool:
        """Follow another plan, shape (n, 3). Always return True."""
        self._plan_frame, self._plan = frame, poses
        self._planner.start_plan()
        self._rotation.start_plan()
        return True

    def is_goal_reached(self) -> bool:
        """Return whether the robot has stopped at the end of the plan, facing in the goal's direction."""
        pose, goal = self._costmap.robot_pose(), self._goal()
        if pose is None or goal is None:
            return False
        return self._rotation.has_reached(pose, self._velocity, goal)

    def command(self) -> Triple | None:
        """Return the next velocity to command.

        Return None if no velocity is legal, the pose or the goal is unknown, or no pose in the plan is near.
        """
        pose, goal = self._costmap.robot_pose(), self._goal()
        local = None if pose is None else self._local(pose)
        if pose is None or goal is None or local is None or not len(local):
            return None
        with self._costmap.lock:
            self._planner.look_at(self._costmap.grid, self._costmap.footprint, pose, local[:, :2])
            if self._rotation.is_there(pose, goal):
                return self._turn(pose, goal)
            shown = self._tried if self._shows_tried else None
            is_shown = shown is not None and shown.connection_count > 0
            choice = self._planner.choose(pose, self._velocity, only_best=not is_shown)
            if shown is not None and is_shown:
                shown.publish(self._tried_cloud(choice))
            if self._shows_costs and self._costs.connection_count:
                self._costs.publish(self._cost_cloud())
        if choice.command is not None:
            for publisher, way in ((self._global_plan, local), (self._local_plan, choice.way)):
                if publisher.connection_count:
                    publisher.publish(plane.path(way, self._costmap.global_frame, stamp(self._node.clock)))
        return choice.command

    def _turn(self, pose: Triple, goal: Triple) -> Triple | None:
        velocity = self._velocity
        return self._rotation.command(
            pose, velocity, goal, lambda command: self._planner.is_legal(pose, velocity, command)
        )

    # -- the plan in the costmap -------------------------------------------------

    def _frame(self) -> Triple | None:
        """Return the latest pose of the plan's frame in the costmap's frame."""
        target = self._costmap.global_frame
        if target == self._plan_frame:
            return STILL
        try:
            return plane.flat(self._costmap.frames.at(target, self._plan_frame, 0))
        except TransformException as error:
            self._costmap.warn("the plan cannot be transformed to the frame %s: %s", target, error)
            return None

    def _goal(self) -> Triple | None:
        frame = self._frame() if len(self._plan) else None
        if frame is None:
            return None
        x, y, yaw = map(float, plane.in_frame(frame, self._plan[-1:])[0])
        return x, y, yaw

    def _local(self, pose: Triple) -> Poses | None:
        """Return the first part of the plan that is within half the costmap's longer side of the robot.

        The pose after this part is included. With `prune_plan`, the poses before the first pose within 1 m of
        the robot are dropped. Return None if the transform to the costmap's frame is unknown.
        """
        frame = self._frame()
        if frame is None:
            return None
        placed = plane.in_frame(frame, self._plan)
        distance = np.hypot(placed[:, 0] - pose[0], placed[:, 1] - pose[1])
        grid = self._costmap.grid
        reach = max(grid.costs.shape) * grid.resolution / 2
        near = np.flatnonzero(distance <= reach)
        if not near.size:
            return placed[:0]
        beyond = np.flatnonzero(distance[near[0] :] > reach)
        end = near[0] + int(beyond[0]) + 1 if beyond.size else len(placed)
        first = int(near[0])
        if self._settings.prune_plan:
            close = np.flatnonzero(distance[first:end] < _NEAR_M)
            first += int(close[0]) if close.size else end - first
            self._plan = self._plan[first:]
        return placed[first:end]

    # -- visualization -----------------------------------------------------------

    def _tried_cloud(self, choice: Choice) -> Any:
        tried, scores = choice.tried, choice.scores
        mask = (np.arange(tried.x.shape[1]) < tried.counts[:, None]) & (scores >= 0)[:, None]
        rows = [tried.x[mask], tried.y[mask], np.zeros(int(mask.sum())), tried.yaw[mask]]
        rows.append(np.broadcast_to(scores[:, None], mask.shape)[mask])
        names = ("x", "y", "z", "theta", "cost")
        return plane.cloud(names, np.column_stack(rows), self._cloud_frame, stamp(self._node.clock))

    def _cost_cloud(self) -> Any:
        grid, settings = self._costmap.grid, self._settings
        path, goal = self._planner.distances[:2]
        row, column = np.nonzero((path < grid.costs.size) & (grid.costs < INSCRIBED))
        costs = grid.costs[row, column].astype(float)
        x, y = grid.cell_to_world(column, row)
        to_path, to_goal = path[row, column], goal[row, column]
        total = settings.path_distance_bias * to_path + settings.goal_distance_bias * to_goal
        per_cell, per_cost = self._planner.scales()
        total = per_cell * total + per_cost * settings.occdist_scale * costs
        values = np.column_stack((x, y, np.zeros(len(x)), to_path, to_goal, costs, total))
        names = ("x", "y", "z", "path_cost", "goal_cost", "occ_cost", "total_cost")
        return plane.cloud(names, values, self._costmap.global_frame, stamp(self._node.clock))
