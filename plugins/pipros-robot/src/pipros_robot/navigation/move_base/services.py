"""The services of move_base: `~make_plan` and `~clear_costmaps`."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any, Final

import numpy as np

from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import stamp
from pipros.node.service_server import CallFailed
from pipros_libraries.nodes.wiring import serve
from pipros_robot.navigation import plane
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.costmap.grid import FREE
from pipros_robot.navigation.costmap.layered import Pose2D
from pipros_robot.navigation.move_base.settings import MoveBaseSettings
from pipros_robot.navigation.navfn.navfn_node import NavfnPlanner
from pipros_robot.navigation.plane import Triple

_TRIES: Final = 10_000
"""The most poses beside a goal to which a plan is sought: up to 7 m away, with cells of 0.05 m."""


class PlanService:
    """Serves plans to other nodes, and clears the costmaps on request."""

    def __init__(
        self,
        node: Node,
        log: logging.Logger,
        planner: NavfnPlanner,
        maps: tuple[Costmap, Costmap],
        clearing_radius: float,
        locate: Callable[[Any], Triple | None],
        is_active: Callable[[], bool],
        settings: Callable[[], MoveBaseSettings],
    ) -> None:
        """Offer the services.

        Args:
            maps: the global and the local costmap.
            clearing_radius: half the side, in metres, of the square around the robot that `~make_plan` frees.
            locate: function that converts a PoseStamped to a pose in the global frame, or returns None.
            is_active: function that returns whether move_base has a goal.
            settings: function that returns the parameters of move_base.
        """
        self._node, self._log, self._planner, self._maps = node, log, planner, maps
        self._radius, self._locate, self._is_active = clearing_radius, locate, is_active
        self._settings = settings
        serve(node, "~make_plan", "nav_msgs/GetPlan", self._make_plan)
        serve(node, "~clear_costmaps", "std_srvs/Empty", lambda _: self._clear())

    def _clear(self) -> None:
        for costmap in self._maps:
            costmap.reset_layers()

    def _make_plan(self, request: Any) -> Any:
        if self._is_active():
            self._log.error("make_plan works only while move_base has no goal")
            raise CallFailed
        global_map = self._maps[0]
        start = self._locate(request.start) if request.start.header.frame_id else global_map.robot_pose()
        goal = self._locate(request.goal)
        if start is None:
            self._log.error("make_plan: the start is unknown")
            raise CallFailed
        if self._settings().make_plan_clear_costmap:
            self._free_surroundings()
        if goal is None:
            return None
        near = _around(goal, request.tolerance, global_map.grid.resolution)
        for tried in (goal, *islice(near, _TRIES)):
            if self._is_active():
                self._log.error("make_plan ends, because move_base has a goal now")
                raise CallFailed
            plan = self._planner.make_plan(Pose2D(*start), Pose2D(*tried))
            if plan is not None:
                if tried != goal and self._settings().make_plan_add_unreachable_goal:
                    plan = np.vstack((plan, goal))
                poses = plane.path(plan, global_map.global_frame, stamp(self._node.clock)).poses
                return load_message_class("nav_msgs/Path")(poses=poses)
        return None

    def _free_surroundings(self) -> None:
        for costmap in self._maps:
            pose, reach = costmap.robot_pose(), self._radius
            if pose is not None:
                x, y, _ = pose
                square = [(x + a * reach, y + b * reach) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
                with costmap.lock:
                    costmap.grid.fill_polygon(square, FREE)


def _around(goal: Triple, tolerance: float, resolution: float) -> Iterator[Triple]:
    """Yield poses around a goal, on squares of growing size up to the tolerance, in move_base's order."""
    step = 3 * resolution
    if 0 < tolerance < step:
        step = tolerance
    for ring in range(1, int(min(tolerance, plane.MOST) / step + 1e-6) + 1 if tolerance > 0 else 1):
        for up in range(ring + 1):
            for across in range(ring + 1):
                if max(up, across) == ring:
                    for y in dict.fromkeys((-up, up)):
                        for x in dict.fromkeys((-across, across)):
                            yield goal[0] + x * step, goal[1] + y * step, goal[2]
