"""The world of a turtlesim node: its turtles, and the picture that they draw.

This module reads no clock and performs no I/O. The owner of a world calls `tick` every 16 ms.
"""

from __future__ import annotations

import logging
import random
from collections import deque
from collections.abc import Callable
from typing import Final

from pipros.basics.errors import PiprosError
from pipros_simulation.turtlesim.picture import TurtleColor, TurtlePicture
from pipros_simulation.turtlesim.turtle import LOOKS, SIDE_M, Line, Turtle

BACKGROUND: Final = TurtleColor(0x45, 0x56, 0xFF)
LINES_KEPT: Final = 2000
"""Number of lines kept for pages. A page that falls further behind receives the whole picture again."""


class TurtleRejected(PiprosError):
    """The world cannot perform a request. The error text is logged."""


class TurtleWorld:
    """Turtles by name, and the picture. Not thread-safe.

    Attributes:
        turtles: the turtles, in the order in which they were spawned.
        picture: background and lines, without turtles.
        lines: the newest lines, for pages.
        lines_drawn: the number of lines drawn since the picture was last cleared.
        clears: number of times that the picture has been cleared.
    """

    def __init__(
        self,
        log: logging.Logger,
        *,
        background: TurtleColor = BACKGROUND,
        namespace: str = "/",
        limit: int = 1000,
        look: Callable[[], int] = lambda: random.randrange(LOOKS),  # noqa: S311 - a drawing, no secret
    ) -> None:
        """Create a world with one turtle in the middle.

        Args:
            background: the colour of the picture.
            namespace: namespace of the node, with a trailing slash, for the log.
            limit: the maximum number of turtles.
            look: function that returns the index of the image for a new turtle.
        """
        self.turtles: dict[str, Turtle] = {}
        self.lines: deque[Line] = deque(maxlen=LINES_KEPT)
        self.lines_drawn = 0
        self.clears = 0
        self._namespace = namespace
        self._limit = limit
        self._look = look
        self._log = log
        self._counter = 0
        self.picture = TurtlePicture(background)
        self._spawn_first()

    def spawn(self, name: str, x: float, y: float, theta: float) -> Turtle:
        """Add a turtle. An empty name is replaced by `turtle` and a new number.

        Raises:
            TurtleRejected: the name is taken, or there are too many turtles.
        """
        if len(self.turtles) >= self._limit:
            raise TurtleRejected(f"too many turtles; the limit is {self._limit}")
        name = name or self._new_name()
        if name in self.turtles:
            raise TurtleRejected(f"A turtled named [{name}] already exists")  # as in genuine turtlesim
        turtle = Turtle(name, (x, y, theta), self._look(), self._log, self._namespace + name)
        self.turtles[name] = turtle
        self._log.info("Spawning turtle [%s] at x=[%f], y=[%f], theta=[%f]", name, x, y, theta)
        return turtle

    def _new_name(self) -> str:
        while True:
            self._counter += 1
            if (name := f"turtle{self._counter}") not in self.turtles:
                return name

    def kill(self, name: str) -> Turtle:
        """Remove a turtle. Its lines remain.

        Raises:
            TurtleRejected: no turtle has this name.
        """
        if name not in self.turtles:
            raise TurtleRejected(f"Tried to kill turtle [{name}], which does not exist")
        return self.turtles.pop(name)

    def clear(self, background: TurtleColor = BACKGROUND) -> None:
        """Remove all lines. The turtles remain."""
        self._log.info("Clearing turtlesim.")
        self._clear(background)

    def reset(self, background: TurtleColor = BACKGROUND) -> Turtle:
        """Remove all turtles and lines, spawn one turtle in the middle, and return it."""
        self._log.info("Resetting turtlesim.")
        self.turtles.clear()
        self._counter = 0
        first = self._spawn_first()
        self._clear(background)
        return first

    def tick(self, now_s: float) -> list[tuple[Turtle, TurtleColor]]:
        """Move all turtles. Return them with the colours that their sensors measure.

        `now_s` is on the clock of `TurtleCommand.arrived_s`, and determines whether commands have expired.
        """
        seen = []
        for turtle in self.turtles.values():
            color, lines = turtle.tick(now_s, self.picture)
            seen.append((turtle, color))
            self.lines.extend(lines)
            self.lines_drawn += len(lines)
        return seen

    def _spawn_first(self) -> Turtle:
        return self.spawn("", SIDE_M / 2, SIDE_M / 2, 0.0)

    def _clear(self, background: TurtleColor) -> None:
        self.picture.fill(background)
        self.lines.clear()
        self.lines_drawn = 0
        self.clears += 1
