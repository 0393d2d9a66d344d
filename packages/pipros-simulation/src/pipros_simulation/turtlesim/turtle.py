"""One turtle: its pose, its pen, and its movement per tick. This module reads no clock and performs no I/O.

Coordinates are in metres from the lower left corner of the picture, x to the right and y up; angles are in
radians, 0 to the right, counter-clockwise. Positions and velocities are in double precision. The side of the
world, the arguments of services and the published pose are in single precision, as in genuine turtlesim,
because the rounding is visible in the published numbers: the first turtle is at 5.544444561004639.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from dataclasses import dataclass, replace
from itertools import starmap
from struct import Struct
from typing import Final

from pipros_simulation.turtlesim.picture import SIDE, Point, TurtleColor, TurtlePicture

_SINGLE: Final = Struct("f")


def single(value: float) -> float:
    """Round to single precision."""
    try:
        rounded: float = _SINGLE.unpack(_SINGLE.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return rounded


PIXELS_PER_M: Final = 45.0
SIDE_M: Final = single((SIDE - 1) / PIXELS_PER_M)
"""Width and height of the world, in metres."""
TICK_S: Final = 0.016
"""The time that a tick simulates, regardless of the time that has passed."""
COMMAND_S: Final = 1.0
"""How long a velocity command is valid, in wall time."""
PEN_COLOR: Final = TurtleColor(0xB3, 0xB8, 0xFF)
PEN_WIDTH: Final = 3
LOOKS: Final = 14
"""Number of turtle drawings, one of which is chosen at random for each turtle."""


@dataclass(frozen=True, slots=True)
class TurtlePose:
    """The pose that a turtle publishes, in single precision. The velocities are those of the last tick."""

    x: float
    y: float
    theta: float
    linear_velocity: float
    angular_velocity: float


@dataclass(frozen=True, slots=True)
class Line:
    """A line drawn by a pen, in pixels."""

    start: Point
    end: Point
    color: TurtleColor
    width: int


@dataclass(frozen=True, slots=True)
class Teleport:
    """A queued teleport: to x, y and theta, or, if relative, by a turn of theta and then a distance of x."""

    is_relative: bool
    x: float
    y: float
    theta: float


@dataclass(frozen=True, slots=True)
class Pen:
    """A turtle's pen. A `width` of 0 has the same effect as 1."""

    color: TurtleColor = PEN_COLOR
    width: int = PEN_WIDTH
    is_down: bool = True


@dataclass(frozen=True, slots=True)
class TurtleCommand:
    """A command: velocities forwards and to the left (m/s), angular velocity (rad/s), and time of arrival."""

    forwards: float
    left: float
    angular: float
    arrived_s: float


_STAND = TurtleCommand(0.0, 0.0, 0.0, -math.inf)


class Turtle:
    """A turtle in a world.

    `command`, `teleport` and `pen` may be used while another thread runs `tick`; other members may not.

    Attributes:
        name: the name with which the turtle was spawned.
        look: index of the turtle's image, below `LOOKS`.
        x, y, theta: the pose.
    """

    def __init__(
        self, name: str, pose: tuple[float, float, float], look: int, log: logging.Logger, namespace: str
    ) -> None:
        """Create a turtle, initially at rest.

        Args:
            pose: x, y and theta.
            look: index of the turtle's image, below `LOOKS`.
            namespace: namespace of the turtle's topics, for the log.
        """
        self.name = name
        self.look = look
        self.pen = Pen()
        self.x, y, self.theta = pose
        self._down = SIDE_M - y  # computed as in genuine turtlesim, so that all digits match
        self._log = log
        self._namespace = namespace
        self._command = self._active = _STAND  # the newest command, and the command used in the last tick
        self._teleports: deque[Teleport] = deque()

    @property
    def teleports_waiting(self) -> int:
        """The number of teleports queued since the last tick."""
        return len(self._teleports)

    def command(self, command: TurtleCommand) -> None:
        """Set the velocities for the next `COMMAND_S` seconds."""
        self._command = command

    def lift_pen(self) -> None:
        """Lift the pen, which keeps its colour and width."""
        self.pen = replace(self.pen, is_down=False)

    def teleport(self, teleport: Teleport) -> None:
        """Queue a teleport for the next tick."""
        self._teleports.append(teleport)

    @property
    def pixel(self) -> Point:
        """The turtle's position in the picture."""
        return self.x * PIXELS_PER_M, self._down * PIXELS_PER_M

    @property
    def y(self) -> float:
        return SIDE_M - self._down

    @property
    def pose(self) -> TurtlePose:
        """The pose to publish. The linear velocity is an absolute value, as in genuine turtlesim."""
        speed = math.hypot(self._active.forwards, self._active.left)
        return TurtlePose(*map(single, (self.x, self.y, self.theta, speed, self._active.angular)))

    def tick(self, now_s: float, picture: TurtlePicture) -> tuple[TurtleColor, list[Line]]:
        """Move for one tick, and draw on the picture.

        Returns:
            The colour at the new position before the line of this move was drawn, and all lines drawn in this
            tick.
        """
        lines = [line for line in starmap(self._drawn, self._do_teleports()) if line is not None]
        for line in lines:
            picture.draw_line(line.start, line.end, line.color, line.width)
        before = self.pixel
        self._move(now_s)
        color = picture.color_at(self.pixel)
        last = self._drawn(before, self.pixel)
        if last is not None:
            picture.draw_line(last.start, last.end, last.color, last.width)
            lines.append(last)
        return color, lines

    def _do_teleports(self) -> list[tuple[Point, Point]]:
        moves = []
        while self._teleports:
            teleport = self._teleports.popleft()
            before = self.pixel
            if teleport.is_relative:
                self.theta += teleport.theta
                self.x += math.cos(self.theta) * teleport.x
                self._down -= math.sin(self.theta) * teleport.x
            else:
                self.x, self.theta = teleport.x, teleport.theta
                self._down = max(0.0, SIDE_M - teleport.y)
            moves.append((before, self.pixel))
        return moves

    def _move(self, now_s: float) -> None:
        command = self._command
        if now_s - command.arrived_s > COMMAND_S:
            command = _STAND
        self._active = command
        forwards, left = command.forwards, command.left
        theta = self.theta + command.angular * TICK_S
        self.theta = theta = theta - math.tau * math.floor((theta + math.pi) / math.tau)
        cosine, sine = math.cos(theta), math.sin(theta)
        self.x += cosine * forwards * TICK_S - sine * left * TICK_S
        self._down -= cosine * left * TICK_S + sine * forwards * TICK_S
        if not (0 <= self.x <= SIDE_M and 0 <= self._down <= SIDE_M):
            self._log.warning("Oh no! I hit the wall! (Clamping from [x=%f, y=%f])", self.x, self._down)
            self.x = min(max(self.x, 0.0), SIDE_M)
            self._down = min(max(self._down, 0.0), SIDE_M)
        self._log.debug(
            "[%s]: pos_x: %f pos_y: %f theta: %f", self._namespace, self.x, self._down, self.theta
        )

    def _drawn(self, start: Point, end: Point) -> Line | None:
        """Return the line drawn by a move, or None if the pen is up or the turtle did not move."""
        if not self.pen.is_down or start == end:
            return None
        return Line(start, end, self.pen.color, self.pen.width)
