"""`turtle_teleop_key`: steers a turtle with the arrow keys in a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.terminals import single_keys
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import read
from pipros_libraries.nodes.velocities import VelocityOutput
from pipros_libraries.teleoperation.pressed_keys import pressed_keys

TEXT: Final = f"""\
Reading from keyboard
{"-" * 27}
Use arrow keys to move the turtle. 'q' to quit."""

KEYS: Final = {"A": (1.0, 0.0), "B": (-1.0, 0.0), "C": (0.0, -1.0), "D": (0.0, 1.0)}
"""Factors for the linear and the angular scale, by the last letter of an arrow key's escape sequence."""


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `turtle_teleop_key` until `q` is pressed, the input ends, or the node is shut down."""
    with roscpp_program("teleop_turtle", "turtlesim", argv) as (node, _):
        linear, angular = _scale(node, "scale_linear"), _scale(node, "scale_angular")
        commands = VelocityOutput(node, "turtle1/cmd_vel")
        print(TEXT, flush=True)
        with single_keys(of_launcher=True):
            for key in pressed_keys(node):
                if key == "q":
                    break
                if key in KEYS:
                    twist = commands.message()
                    twist.linear.x, twist.angular.z = linear * KEYS[key][0], angular * KEYS[key][1]
                    commands.publish(twist)
    return 0


def _scale(node: Node, parameter: str) -> float:
    """Return a parameter in the node's namespace, where launch files set it. The default is 2.0."""
    try:
        return read(node.params.get(parameter), 2.0)
    except (LookupError, PiprosError):
        return 2.0
