"""`draw_square`: drives a turtle repeatedly along a square."""

from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Sequence
from enum import Enum, auto
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class, load_service_class
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.velocities import VelocityOutput

SIDE_M: Final = 2.0
PERIOD_S: Final = 0.016
RESET_S: Final = 1.0
_SPEED: Final = 1.0
_TURNING: Final = 0.4
_NEAR_M: Final = 0.1
_NEAR_RAD: Final = 0.01
_STANDING: Final = 0.0001


class Phase(Enum):
    """The phases of the turtle's movement, in order. STOPPING_TURN is followed by FORWARD."""

    FORWARD = auto()
    STOPPING_FORWARD = auto()
    TURN = auto()
    STOPPING_TURN = auto()


_NEXT = {
    Phase.FORWARD: Phase.STOPPING_FORWARD,
    Phase.STOPPING_FORWARD: Phase.TURN,
    Phase.TURN: Phase.STOPPING_TURN,
    Phase.STOPPING_TURN: Phase.FORWARD,
}
_SPEEDS = {Phase.FORWARD: (_SPEED, 0.0), Phase.TURN: (0.0, _TURNING)}


class Square:
    """Computes the velocities that drive the turtle along a square."""

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._phase = Phase.FORWARD
        self._goal: tuple[float, float, float] | None = None

    def velocities(self, pose: Any) -> tuple[float, float]:
        """Return the linear and angular velocity for the newest pose."""
        if self._goal is None:
            self._set_goal(pose, forwards=True)
        elif self._phase in _SPEEDS:
            if self._has_reached(pose):
                self._phase = _NEXT[self._phase]
        elif abs(pose.linear_velocity) < _STANDING and abs(pose.angular_velocity) < _STANDING:
            self._log.info("Reached goal")
            self._phase = _NEXT[self._phase]
            self._set_goal(pose, forwards=self._phase is Phase.FORWARD)
            return 0.0, 0.0
        return _SPEEDS.get(self._phase, (0.0, 0.0))

    def _set_goal(self, pose: Any, *, forwards: bool) -> None:
        if forwards:
            x, y = pose.x + SIDE_M * math.cos(pose.theta), pose.y + SIDE_M * math.sin(pose.theta)
            self._goal = x, y, pose.theta
        else:
            self._goal = pose.x, pose.y, math.remainder(pose.theta + math.pi / 2, math.tau)
        self._log.info("New goal [%f %f, %f]", *self._goal)

    def _has_reached(self, pose: Any) -> bool:
        x, y, theta = self._goal or (0.0, 0.0, 0.0)
        turn = math.remainder(pose.theta - theta, math.tau)
        return abs(pose.x - x) < _NEAR_M and abs(pose.y - y) < _NEAR_M and abs(turn) < _NEAR_RAD


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Reset turtlesim, then drive its turtle `turtle1` until the node is shut down."""
    pose_class: Any = load_message_class("turtlesim/Pose")
    empty: Any = load_service_class("std_srvs/Empty")
    newest: list[Any] = []
    with roscpp_program("draw_square", "turtlesim", argv) as (node, log):
        commands = VelocityOutput(node, "turtle1/cmd_vel")

        def keep(pose: Any) -> None:
            newest[:] = [pose]

        poses = node.subscribe("turtle1/pose", pose_class, keep, queue_size=1)
        with contextlib.suppress(PiprosError, OSError):  # as in Noetic, do not wait for turtlesim
            node.client("reset", empty).call(empty._request_class(), timeout_s=RESET_S)
        square = Square(log)
        while not node.wait_for_shutdown(PERIOD_S):
            if not poses.connection_count:
                commands.stop()
            elif newest:
                twist = commands.message()
                twist.linear.x, twist.angular.z = square.velocities(newest[0])
                commands.publish(twist)
    return 0
