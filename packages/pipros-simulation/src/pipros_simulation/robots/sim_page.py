"""Page that shows simulated robots, walls and laser scans. Users can drag or steer the robots.

The page affects only this node: it moves the node's robots without a topic or a service.
"""

from __future__ import annotations

import asyncio
import base64
import math
from collections.abc import AsyncIterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipros.node import Node
from pipros_libraries.pictures.png import png
from pipros_server.view_server import RequestRefused, ServedViews
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.errors import Rejected
from pipros_simulation.robots.robots_node import RobotsNode
from pipros_simulation.robots.world import World

FRAME_S: Final = 0.1
"""Interval of updates for a browser."""
LONGEST_SIDE: Final = 2000
"""Maximum width and height of the image of the walls. In larger maps, several cells become one pixel."""
POINTS: Final = 180
"""Maximum number of points of a scan that are shown."""


class SimPage:
    """Views and actions of the page."""

    def __init__(self, robots: RobotsNode, node: Node) -> None:
        self._robots = robots
        self._node = node

    def served_views(self) -> ServedViews:
        """Return the views and actions for a server."""
        return ServedViews(
            views={"world": self.world},
            actions={"place": self.place, "steer": self.steer, "reset": self.reset, "close": self.close},
            pages=("pipros_simulation.robots", "pipros_server"),
        )

    async def world(self, _: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the walls once, then all robots after each step, but at most once per `FRAME_S`."""
        world = self._robots.simulation.world
        picture = await asyncio.to_thread(walls_picture, world)
        yield {
            "node": self._node.name,
            "walls": base64.b64encode(picture).decode(),
            "area": [world.left, world.bottom, *world.size],
        }
        steps = -1
        while True:
            if steps != self._robots.simulation.steps:
                with self._robots.lock:
                    steps = self._robots.simulation.steps
                    shown = self._shown()
                yield {"time": round(self._robots.simulation.time_s, 2), "robots": shown}
            await asyncio.sleep(FRAME_S)

    async def place(self, arguments: Mapping[str, Any]) -> None:
        """Move a robot to a pose."""
        x, y, yaw = (_number(arguments, key) for key in ("x", "y", "yaw"))
        try:
            with self._robots.lock:
                self._robots.simulation.place(str(arguments.get("robot")), Pose(x, y, yaw))
        except Rejected as error:
            raise RequestRefused(str(error)) from None

    async def steer(self, arguments: Mapping[str, Any]) -> None:
        """Set the velocity of one of this node's robots, as a message on its `cmd_vel` topic would."""
        linear, angular = (_number(arguments, key) for key in ("linear", "angular"))
        with self._robots.lock:
            simulation = self._robots.simulation
            robot = simulation.robots.get(str(arguments.get("robot")))
            if robot is None:
                raise RequestRefused(f"there is no robot named {arguments.get('robot')!r}")
            robot.command(linear, angular, simulation.time_s)

    async def reset(self, _: Mapping[str, Any]) -> None:
        """Move all robots and obstacles back to their starting poses."""
        with self._robots.lock:
            self._robots.simulation.reset()

    async def close(self, _: Mapping[str, Any]) -> None:
        """Shut down the node."""
        self._node.shutdown_async("closed on the page")

    def _shown(self) -> list[Any]:
        """Return the name, pose, radius, bumper, battery and scan points of each robot."""
        simulation = self._robots.simulation
        shown = []
        for name, robot in simulation.robots.items():
            pose = robot.pose
            shown.append(
                {
                    "name": name,
                    "pose": [round(pose.x, 3), round(pose.y, 3), round(pose.yaw, 4)],
                    "radius": robot.settings.radius,
                    "bumped": robot.is_bumped,
                    "battery": round(robot.battery.percentage, 3),
                    "points": _rounded(simulation.echoes(name, POINTS)),
                }
            )
        return shown


def walls_picture(world: World) -> bytes:
    """Return the walls as a PNG file, black on white, with the highest y on top."""
    walls: NDArray[np.bool_] = world.walls[::-1]
    factor = max(1, math.ceil(max(walls.shape) / LONGEST_SIDE))
    if factor > 1:
        rows, columns = (math.ceil(side / factor) for side in walls.shape)
        padded = np.zeros((rows * factor, columns * factor), bool)
        padded[: walls.shape[0], : walls.shape[1]] = walls
        walls = np.logical_or.reduce(padded.reshape(rows, factor, columns, factor), axis=(1, 3))
    greys = np.where(walls, 0, 255).astype(np.uint8)
    height, width = greys.shape
    return png(width, height, 1, 8, (row.tobytes() for row in greys))


def _number(arguments: Mapping[str, Any], key: str) -> float:
    value = arguments.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise RequestRefused(f"{key} must be a finite number")
    return float(value)


def _rounded(points: Any) -> list[list[float]]:
    rounded: list[list[float]] = np.round(points, 2).tolist()
    return rounded
