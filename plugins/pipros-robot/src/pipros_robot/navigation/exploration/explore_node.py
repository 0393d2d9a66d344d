"""The node `explore` of explore_lite: sends move_base to one frontier after the other until none is left."""

from __future__ import annotations

import logging
import math
import threading
from typing import Any, Final

import numpy as np

from pipros.basics.intervals import elapsed
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.actions.status import TERMINAL, Status
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter, read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, stamped, subscribe
from pipros_libraries.transforms.messages import in_ns
from pipros_robot.navigation import plane
from pipros_robot.navigation.costmap.grid import UNKNOWN, CostGrid
from pipros_robot.navigation.exploration.frontiers import Frontier, Place, frontiers, is_near

_REFUSED_CELLS: Final = 5
"""A goal closer than this number of cells to a goal that failed is not sent."""
_COSTS: Final = np.array(
    [0, *(1 + 251 * (value - 1) // 97 for value in range(1, 99)), 253, 254, *[UNKNOWN] * 155], np.uint8
)
"""The costs by the published values, of which those below 0 count as unknown."""
_POINTS, _SPHERE, _ADD, _DELETE = 8, 2, 0, 2
_BLUE, _RED, _GREEN = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


class ExploreNode:
    """Sends goals to move_base. Callbacks run in several threads and share one lock."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Register the topics, and start planning.

        Raises:
            InvalidParameter: a parameter has an invalid value.
        """
        given = read_parameters(node)
        rate = given.number("planner_frequency", 1.0)
        self._timeout_s = given.number("progress_timeout", 30.0, is_endless=True)
        self._scales = {
            "potential_scale": given.number("potential_scale", 1e-3),
            "gain_scale": given.number("gain_scale", 1.0),
            "least_m": given.number("min_frontier_size", 0.5),
        }
        if not rate > 0:
            raise InvalidParameter(f"~planner_frequency must be > 0, got {rate}")
        if not self._timeout_s >= 0:
            raise InvalidParameter(f"~progress_timeout must be >= 0, got {self._timeout_s}")
        self._tolerance_s = given.number("transform_tolerance", 0.3)
        self._base = given.text("robot_base_frame", "base_link").lstrip("/")
        self._node, self._log, self._quiet, self._lock = node, log, Throttle(log, 5.0), threading.RLock()
        self._frames, self._grid, self._frame = Frames(node, log), CostGrid(), ""
        self._refused: list[Place] = []
        self._goal = ""
        self._target: Place | None = None
        self._nearest_m, self._nearer_ns, self._count, self._shown, self._has_ended = math.inf, 0, 0, 0, False
        self._goals = advertise(node, "move_base/goal", "move_base_msgs/MoveBaseActionGoal", 10)
        self._cancel = advertise(node, "move_base/cancel", "actionlib_msgs/GoalID", 10)
        is_visible = given.boolean("visualize", False)
        kind = "visualization_msgs/MarkerArray"
        self._markers = advertise(node, "~frontiers", kind, 5) if is_visible else None
        topic = given.text("costmap_topic", "costmap")
        subscribe(node, topic, "nav_msgs/OccupancyGrid", self._on_map, 1000)
        updates = given.text("costmap_updates_topic", "costmap_updates")
        subscribe(node, updates, "map_msgs/OccupancyGridUpdate", self._on_update, 1000)
        subscribe(node, "move_base/result", "move_base_msgs/MoveBaseActionResult", self._on_result, 10)
        schedule.every(1.0 / rate, self._plan)

    # -- the map -----------------------------------------------------------------

    def _on_map(self, message: Any) -> None:
        info, data = message.info, np.array(message.data, np.int8)
        place = info.origin.position
        numbers = info.resolution, place.x, place.y
        if len(data) != info.width * info.height or not (info.resolution > 0 and np.isfinite(numbers).all()):
            self._quiet.warning(
                "a map is dropped: it has %d cells, width %d, height %d, resolution and origin %s",
                len(data), info.width, info.height, numbers,
            )  # fmt: skip
            return
        with self._lock:
            self._grid.resize(info.width, info.height, *numbers)
            self._grid.costs = _COSTS[data.view(np.uint8)].reshape(info.height, info.width)
            self._frame = message.header.frame_id.lstrip("/")

    def _on_update(self, message: Any) -> None:
        """Change a part of the map."""
        rows, columns = (
            slice(first, first + count)
            for first, count in ((message.y, message.height), (message.x, message.width))
        )
        data = np.array(message.data, np.int8).view(np.uint8)
        with self._lock:
            height, width = self._grid.costs.shape
            is_inside = (
                rows.start >= 0 and rows.stop <= height and columns.start >= 0 and columns.stop <= width
            )
            if not is_inside or len(data) != message.width * message.height:
                self._quiet.warning("an update of the map is dropped: it does not fit the map")
                return
            self._grid.costs[rows, columns] = _COSTS[data].reshape(message.height, message.width)

    def _robot(self) -> Place | None:
        """Return the robot's position on the map, or None if it is unknown or too old."""
        pose = self._frames.find(self._frame, self._base, 0)
        if pose is None:
            return None
        newest_ns = self._frames.buffer.latest_common_time(self._frame, self._base)
        age_s = (self._node.clock.now_ns() - newest_ns) / NS_PER_S
        if newest_ns and age_s > self._tolerance_s:
            self._quiet.warning("the robot's pose is %.2f s old; ~transform_tolerance is %.2f", age_s,
                                self._tolerance_s)  # fmt: skip
            return None
        return pose[0], pose[1]

    # -- goals -------------------------------------------------------------------

    def _plan(self) -> None:
        """Send the robot to the best frontier, unless it already drives there."""
        with self._lock:
            if self._has_ended or not self._grid.costs.size or not self._goals.connection_count:
                return
            robot = self._robot()
            if robot is None:
                return
            found = frontiers(self._grid, robot, **self._scales)
            if self._markers is not None:
                self._show(self._markers, found)
            best = next((each for each in found if not self._is_refused(each.centroid)), None)
            if best is None:
                self._end()
                return
            now_ns = self._node.clock.now_ns()
            is_same = self._target is not None and is_near(self._target, best.centroid, 0.01)
            if not is_same or best.distance < self._nearest_m:
                self._nearest_m, self._nearer_ns = best.distance, now_ns
            self._nearer_ns = min(self._nearer_ns, now_ns)  # the clock may have moved back
            if elapsed(now_ns, self._nearer_ns) > self._timeout_s * NS_PER_S:
                self._log.warning("no progress towards (%.2f, %.2f): the goal is given up", *best.centroid)
                self._refused.append(best.centroid)
                self._plan()
            elif not is_same:
                self._send(best.centroid)

    def _is_refused(self, place: Place) -> bool:
        tolerance = _REFUSED_CELLS * self._grid.resolution
        return any(is_near(place, each, tolerance) for each in self._refused)

    def _send(self, place: Place) -> None:
        self._count += 1
        now = stamp(self._node.clock)
        goal = stamped("move_base_msgs/MoveBaseActionGoal", "", now)
        goal.goal_id.stamp = now
        goal.goal_id.id = f"{self._node.name}-{self._count}-{in_ns(now) / NS_PER_S:.9f}"
        goal.goal.target_pose = plane.stamped_pose((*place, 0.0), self._frame, now)
        self._goal, self._target = goal.goal_id.id, place
        self._goals.publish(goal)

    def _on_result(self, message: Any) -> None:
        with self._lock:
            if self._target is None or message.status.goal_id.id != self._goal:
                return
            self._goal = ""
            if message.status.status in TERMINAL - {Status.SUCCEEDED, Status.PREEMPTED}:
                self._log.warning("move_base cannot reach (%.2f, %.2f)", *self._target)
                self._refused.append(self._target)
            self._plan()

    def _end(self) -> None:
        """Cancel the goal, and stop planning."""
        self._has_ended = True
        self._log.info("exploration stopped: no frontier is left")
        if self._goal:
            self._cancel.publish(load_message_class("actionlib_msgs/GoalID")(id=self._goal))
            self._goal = ""

    # -- visualization -----------------------------------------------------------

    def _show(self, publisher: Any, found: list[Frontier]) -> None:
        """Publish each frontier as points, red if it is refused, with a sphere at its nearest point."""
        lowest = found[0].cost if found else 0.0
        markers: list[Any] = []
        for each in found:
            color = _RED if self._is_refused(each.centroid) else _BLUE
            markers.append(self._marker(len(markers), _POINTS, 0.1, color, points=_points(each.points)))
            size = min(abs(lowest * 0.4 / each.cost), 0.5) if each.cost else 0.5
            sphere = self._marker(len(markers), _SPHERE, size, _GREEN)
            sphere.pose.position.x, sphere.pose.position.y = each.nearest
            markers.append(sphere)
        count = len(markers)
        for number in range(count, self._shown):
            markers.append(self._marker(number, _POINTS, 0.1, _BLUE, action=_DELETE))
        self._shown = count
        publisher.publish(load_message_class("visualization_msgs/MarkerArray")(markers))

    def _marker(self, number: int, kind: int, size: float, color: tuple[float, ...], **fields: Any) -> Any:
        made = stamped("visualization_msgs/Marker", self._frame, stamp(self._node.clock), **fields)
        made.ns, made.id, made.type, made.frame_locked = "frontiers", number, kind, True
        made.pose.orientation.w = 1.0
        made.scale.x = made.scale.y = made.scale.z = size
        made.color.r, made.color.g, made.color.b = color
        made.color.a = 1.0
        return made


def _points(places: tuple[Place, ...]) -> list[Any]:
    point = load_message_class("geometry_msgs/Point")
    return [point(x, y, 0.0) for x, y in places]


def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("explore", "explore_lite", ExploreNode)
