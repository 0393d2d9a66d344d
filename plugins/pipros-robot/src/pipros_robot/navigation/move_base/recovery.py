"""Recovery behaviours: clear obstacles from the costmaps, and turn in place.

After `begin`, move_base calls a behaviour's `recover` once per cycle until it returns True.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np

from pipros.node import Node
from pipros_libraries.nodes.params import PrivateParameters, read_parameters
from pipros_libraries.nodes.velocities import Limit, check_axis
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.dwa.grid_costs import outline_costs
from pipros_robot.navigation.plane import Triple

_LIMITS: Final = "~TrajectoryPlannerROS"
"""The namespace of the limits of turns, whichever local planner runs."""
_MOST_STEPS: Final = 10_000
"""Maximum number of poses that are checked before each command of a turn."""


@dataclass(frozen=True, slots=True)
class Tools:
    """Resources for behaviours: the node, its log, both costmaps, and a function that sends velocities.

    Attributes:
        fastest_turn: returns the greatest rate of turning in place of the local planner in rad/s, which is
            0 for a car.
    """

    node: Node
    log: logging.Logger
    global_map: Costmap
    local_map: Costmap
    drive: Callable[[Triple], None]
    fastest_turn: Callable[[], float] = lambda: math.inf


class Behaviour(Protocol):
    """A recovery behaviour."""

    def begin(self) -> None:
        """Start at the robot's current pose."""

    def recover(self) -> bool:
        """Perform the next step. Return True when the behaviour has ended."""


class ClearCostmap:
    """Clears obstacles outside (or inside) a square around the robot, in the layers in `layer_names`."""

    def __init__(self, tools: Tools, name: str) -> None:
        given = read_parameters(tools.node, f"~{name}")
        self._tools = tools
        self._side = given.number("reset_distance", 3.0)
        self._is_inside = given.boolean("invert_area_to_clear", False)
        self._updates_at_once = given.boolean("force_updating", False)
        self._layers = _texts(given, "layer_names", ["obstacles"])
        self._affected = given.text("affected_maps", "both")
        if self._affected not in ("local", "global", "both"):
            text = "~%s/affected_maps must be local, global or both, got %s: both are cleared"
            tools.log.warning(text, name, self._affected)
            self._affected = "both"

    def begin(self) -> None:
        """Do nothing."""

    def recover(self) -> bool:
        tools = self._tools
        for costmap, name in ((tools.global_map, "global"), (tools.local_map, "local")):
            pose = costmap.robot_pose() if self._affected in (name, "both") else None
            if pose is None:
                continue
            with costmap.lock:
                for layer in costmap.layered.layers:
                    if layer.name.rpartition("/")[2] in self._layers and hasattr(layer, "clear_area"):
                        self._clear(layer, pose)
            if self._updates_at_once:
                costmap.update()
        return True

    def _clear(self, layer: Any, pose: Triple) -> None:
        grid, half = layer.grid, self._side / 2
        left, low = pose[0] - half - grid.origin_x, pose[1] - half - grid.origin_y
        cells = [int(place / grid.resolution) for place in (left, low, left + 2 * half, low + 2 * half)]
        layer.clear_area(*cells, inside=self._is_inside)


class Rotate:
    """Turns the robot one full turn to the left, so that the sensors cover all directions."""

    def __init__(self, tools: Tools, name: str) -> None:
        given = read_parameters(tools.node, f"~{name}")
        limits = read_parameters(tools.node, _LIMITS)
        self._tools = tools
        self._step = max(given.number("sim_granularity", 0.017), 2 * math.pi / _MOST_STEPS)
        gain = _limit(limits, 3.2, "acc_lim_theta", "acc_lim_th")
        fastest = _limit(limits, 1.0, "max_vel_theta", "max_rotational_vel")
        usual = min(0.4, max(fastest[1], 0.0))
        slowest = _limit(limits, usual, "min_in_place_vel_theta", "min_in_place_rotational_vel")
        check_axis(slowest if fastest[1] else fastest, fastest, gain)
        self._gain, self._fastest, self._slowest = gain[1], fastest[1], slowest[1]
        self._tolerance = limits.number("yaw_goal_tolerance", 0.10)
        self._start: float | None = None
        self._is_half = False

    def begin(self) -> None:
        pose = self._tools.local_map.robot_pose()
        self._start, self._is_half = (None if pose is None else pose[2]), False

    def recover(self) -> bool:
        tools, pose = self._tools, self._tools.local_map.robot_pose()
        if self._start is None or pose is None:
            return True
        fastest = min(self._fastest, tools.fastest_turn())
        if fastest <= 0:
            tools.log.warning("the robot cannot turn in place: the rotation is left out")
            return True
        left = abs(math.remainder(pose[2] - self._start, math.tau))
        if self._is_half and left <= self._tolerance:
            return True
        if not self._is_half:
            to_half = abs(math.remainder(pose[2] - self._start - math.pi, math.tau))
            left = math.pi + to_half
            self._is_half = to_half < self._tolerance
        if not self._is_free(pose, left):
            tools.log.error("the robot cannot turn in place: there may be a collision")
            return True
        speed = min(max(math.sqrt(2 * self._gain * left), self._slowest), fastest)
        tools.drive((0.0, 0.0, speed))
        return False

    def _is_free(self, pose: Triple, turn: float) -> bool:
        """Return whether the footprint stays free of obstacles during the rest of the turn."""
        yaw = pose[2] + np.arange(0.0, turn, self._step)
        costmap = self._tools.local_map
        with costmap.lock:
            places = np.full(yaw.shape, pose[0]), np.full(yaw.shape, pose[1])
            return bool((outline_costs(costmap.grid, costmap.footprint, *places, yaw) >= 0).all())


def _limit(limits: PrivateParameters, usual: float, *names: str) -> Limit:
    """Return the name and value of the first of these limits that is set, or the usual value."""
    name = next(filter(limits.has, names), names[0])
    return f"{_LIMITS}/{name}", limits.number(name, usual)


def _texts(given: PrivateParameters, name: str, default: Sequence[str]) -> Sequence[str]:
    value = given.values.get(name)
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        return default
    return value
