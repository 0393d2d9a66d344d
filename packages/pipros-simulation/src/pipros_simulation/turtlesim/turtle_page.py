"""The page of a turtlesim node: a canvas, arrow keys for its turtles, and a button that shuts down the node.

The page affects only this node: its keys move the node's turtles directly, not through a topic.
"""

from __future__ import annotations

import asyncio
import base64
import itertools
import math
import time
from collections.abc import AsyncIterator, Mapping
from typing import Any, Final

from pipros.node import Node
from pipros_server.view_server import RequestRefused, ServedViews
from pipros_simulation.turtlesim.picture import SIDE, Point
from pipros_simulation.turtlesim.turtle import Line, TurtleCommand
from pipros_simulation.turtlesim.turtlesim_node import Turtlesim

FRAME_S: Final = 1 / 30
"""Minimum interval of updates for a browser."""

_Drawn = tuple[int, int]
"""State of the picture in a browser: `TurtleWorld.clears` and `TurtleWorld.lines_drawn`."""


class TurtlePage:
    """Views and actions of the page."""

    def __init__(self, turtlesim: Turtlesim, node: Node) -> None:
        self._turtlesim = turtlesim
        self._node = node

    def served_views(self) -> ServedViews:
        """Return the views and actions for a server."""
        return ServedViews(
            views={"world": self.world},
            actions={"steer": self.steer, "close": self.close},
            pages=("pipros_simulation.turtlesim", "pipros_server"),
        )

    async def world(self, _: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the turtles and the new lines, or the whole picture if necessary, after each change."""
        drawn: _Drawn | None = None
        sent: Any = None
        while True:
            turtles, changes, drawn = self._since(drawn)
            if changes or turtles != sent:
                yield {"node": self._node.name, "side": SIDE, "turtles": turtles, **changes}
            sent = turtles
            await asyncio.sleep(FRAME_S)

    async def steer(self, arguments: Mapping[str, Any]) -> None:
        """Set the velocity of one of this node's turtles, as a message on its `cmd_vel` topic would."""
        linear, angular = arguments.get("linear"), arguments.get("angular")
        if not all(isinstance(value, int | float) and math.isfinite(value) for value in (linear, angular)):
            raise RequestRefused("linear and angular must be finite numbers")
        with self._turtlesim.lock:
            turtle = self._turtlesim.world.turtles.get(str(arguments.get("turtle")))
        if turtle is None:
            raise RequestRefused(f"there is no turtle named {arguments.get('turtle')!r}")
        turtle.command(TurtleCommand(float(linear or 0), 0.0, float(angular or 0), time.monotonic()))

    async def close(self, _: Mapping[str, Any]) -> None:
        """Shut down the node, like closing the window of genuine turtlesim."""
        self._node.shutdown_async("closed on the page")

    def _since(self, drawn: _Drawn | None) -> tuple[list[Any], dict[str, Any], _Drawn]:
        """Return the turtles, the changes to the picture since an earlier state, and the new state."""
        with self._turtlesim.lock:
            world = self._turtlesim.world
            now = world.clears, world.lines_drawn
            turtles = [
                [turtle.name, *_rounded(turtle.pixel), round(turtle.theta, 4), turtle.look]
                for turtle in world.turtles.values()
            ]
            count = now[1] - drawn[1] if drawn is not None and drawn[0] == now[0] else -1
            if 0 <= count <= len(world.lines):
                lines = list(itertools.islice(world.lines, len(world.lines) - count, None))
                return turtles, {"lines": [_numbers(line) for line in lines]} if lines else {}, now
            picture = world.picture.to_png()
        return turtles, {"picture": base64.b64encode(picture).decode()}, now


def _numbers(line: Line) -> list[Any]:
    color = line.color
    return [*_rounded(line.start), *_rounded(line.end), max(line.width, 1), color.r, color.g, color.b]


def _rounded(point: Point) -> list[float]:
    return [round(value, 2) for value in point]
