"""The program `navfn_node`, and `NavfnPlanner`, which plans on a node's costmap, with topics and services."""

from __future__ import annotations

import logging
import math
from typing import Any

import numpy as np

from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import PrivateParameters, read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, serve, subscribe
from pipros_robot.navigation import plane
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.costmap.grid import FREE, CostGrid
from pipros_robot.navigation.costmap.layered import Pose2D
from pipros_robot.navigation.navfn.plan import PotentialField, find_field
from pipros_robot.navigation.navfn.potential import UNREACHED, Cell
from pipros_robot.navigation.plane import Poses

_POTENTIAL_HEIGHT_M = 20.0


class NavfnPlanner:
    """Plans on a costmap. Poses are (x, y, yaw) in its global frame."""

    def __init__(
        self,
        node: Node,
        log: logging.Logger,
        costmap: Costmap,
        namespace: str = "~NavfnROS",
        given: PrivateParameters | None = None,
    ) -> None:
        """Read the parameters, if they are not `given`, and offer topics and the service in the namespace."""
        self._node, self._log, self._costmap = node, log, costmap
        given = given or read_parameters(node, namespace)
        self._allow_unknown = given.boolean("allow_unknown", True)
        self._tolerance = given.number("default_tolerance", 0.0)
        self._plans = advertise(node, f"{namespace}/plan", "nav_msgs/Path")
        self._potentials: Any = None
        if given.boolean("visualize_potential", False):
            self._potentials = advertise(node, f"{namespace}/potential", "sensor_msgs/PointCloud2")
        serve(node, f"{namespace}/make_plan", "nav_msgs/GetPlan", self._on_make_plan)

    def make_plan(self, start: Pose2D, goal: Pose2D) -> Poses | None:
        """Return and publish a path as rows of (x, y, yaw), or None if there is none.

        The last row is the goal or, with a tolerance, the nearest reachable pose. The cell of `start` is set
        to free in the costmap.
        """
        with self._costmap.lock:
            grid = self._costmap.grid
            first = grid.world_to_cell(start.x, start.y)
            if first is None:
                self._costmap.warn("the start of the plan is off the global costmap; is the robot localized?")
                return None
            last = grid.world_to_cell(goal.x, goal.y)
            if last is None and self._tolerance <= 0:
                self._costmap.warn("the goal of the plan is off the global costmap")
                return None
            grid.costs[first[1], first[0]] = FREE
            seen = CostGrid()
            seen.resize(*grid.geometry)
            seen.costs[...] = grid.costs
        field = find_field(seen.costs, first, last or (0, 0), allow_unknown=self._allow_unknown)
        poses = self._poses(seen, field, goal)
        if self._potentials is not None and self._potentials.connection_count:
            self._publish_potentials(seen, field, last or (0, 0))
        if poses is not None:
            self.publish_plan(poses[:-1])
        self.publish_plan(np.empty((0, 3)) if poses is None else poses)
        return poses

    def _poses(self, grid: CostGrid, field: PotentialField, goal: Pose2D) -> Poses | None:
        end = self._nearest_legal(grid, field, goal)
        cell = grid.world_to_cell(end.x, end.y) if end is not None else None
        if end is None or cell is None:
            self._log.warning("there is no path to (%.3f, %.3f)", goal.x, goal.y)
            return None
        points = field.path_to(cell, 4 * grid.width)
        if not points:
            self._log.error("no path could be traced back from the goal (%.3f, %.3f)", goal.x, goal.y)
            return None
        poses = np.zeros((len(points) + 1, 3))
        poses[:-1, :2] = np.array(points) * grid.resolution + (grid.origin_x, grid.origin_y)
        poses[-1] = end
        return poses

    def _nearest_legal(self, grid: CostGrid, field: PotentialField, goal: Pose2D) -> Pose2D | None:
        """Return the reachable pose nearest to the goal, or None if there is none within the tolerance.

        The tolerance applies to x and y separately.
        """
        tolerance = min(self._tolerance, max(grid.width, grid.height) * grid.resolution)
        steps = math.floor(2 * tolerance / grid.resolution + 1e-9) + 1
        offsets = [at * grid.resolution - tolerance for at in range(steps)]
        best: Pose2D | None = None
        best_distance = math.inf
        for y in offsets:
            for x in offsets:
                cell = grid.world_to_cell(goal.x + x, goal.y + y)
                if x * x + y * y < best_distance and cell and field.potential(cell) < UNREACHED:
                    best, best_distance = Pose2D(goal.x + x, goal.y + y, goal.yaw), x * x + y * y
        return best

    # -- messages ----------------------------------------------------------------

    def publish_plan(self, poses: Poses) -> None:
        """Publish a path, which may be empty, if there are subscribers."""
        if self._plans.connection_count:
            self._plans.publish(plane.path(poses, self._costmap.global_frame, stamp(self._node.clock)))

    def _publish_potentials(self, grid: CostGrid, field: PotentialField, goal: Cell) -> None:
        rows, columns = np.nonzero(field.values < UNREACHED)
        values = field.values[rows, columns]
        x = grid.origin_x + (columns + field.window.x0) * grid.resolution
        y = grid.origin_y + (rows + field.window.y0) * grid.resolution
        height = values / max(field.potential(goal), 1.0) * _POTENTIAL_HEIGHT_M
        points = np.column_stack((x, y, height, values))
        fields = ("x", "y", "z", "pot")
        self._potentials.publish(
            plane.cloud(fields, points, self._costmap.global_frame, stamp(self._node.clock))
        )

    # -- service -----------------------------------------------------------------

    def _on_make_plan(self, request: Any) -> Any:
        frame = self._costmap.global_frame
        plan = plane.path((), frame, stamp(self._node.clock))
        for name, pose in (("goal", request.goal), ("start", request.start)):
            given = pose.header.frame_id
            if given.lstrip("/") != frame:
                self._log.error("the %s must be in the frame %s, got [%s]", name, frame, given)
                return plan
        plan.poses = self.stamped_plan(request.start, request.goal)
        return plan

    def stamped_plan(self, start: Any, goal: Any) -> list[Any]:
        """Return the path between two poses as a list of `geometry_msgs/PoseStamped`, which may be empty."""
        poses = self.make_plan(*(Pose2D(*plane.flat_message(each.pose)) for each in (start, goal)))
        if poses is None:
            return []
        made: list[Any] = plane.path(poses, self._costmap.global_frame, stamp(self._node.clock)).poses
        made[-1].pose.orientation = goal.pose.orientation
        return made


def _serve_plans(node: Node, log: logging.Logger, schedule: Schedule) -> None:
    """Offer the interface of `navfn_node`: plans between two poses, and from the robot to a goal."""
    costmap = Costmap(node, log, Frames(node, log), schedule, "costmap")
    planner = NavfnPlanner(node, log, costmap, "~navfn_planner")

    def on_make_plan(request: Any) -> Any:
        path = planner.stamped_plan(request.start, request.goal)
        return int(bool(path)), "", path

    def on_goal(message: Any) -> None:
        robot = costmap.robot_pose()
        if robot is not None:
            planner.make_plan(robot, Pose2D(*plane.flat_message(message.pose)))

    serve(node, "~make_plan", "navfn/MakeNavPlan", on_make_plan)
    subscribe(node, "~goal", "geometry_msgs/PoseStamped", on_goal)


def main() -> int:
    """Run `navfn_node` until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("global_planner", "navfn", _serve_plans)
