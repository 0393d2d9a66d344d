"""`teleop_node` of teleop_twist_joy: uses a joystick to steer any robot that subscribes to `cmd_vel`."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from typing import Any

from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.params import number, raw
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.velocities import VelocityOutput, checked_number
from pipros_libraries.nodes.wiring import subscribe
from pipros_libraries.teleoperation.joy_commands import (
    ANGULAR,
    LINEAR,
    AxisMap,
    JoyCommands,
    JoySilence,
    by_direction,
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run `teleop_node` until the node is shut down. Return the exit code: 1 if a parameter is invalid."""
    return run_node("teleop_twist_joy", "TeleopTwistJoy", lambda node, log, _: _steer(node, log), argv)


def _steer(node: Node, log: logging.Logger) -> None:
    """Publish the commands of `joy` on `cmd_vel`. Stop if its publisher ends or falls silent."""
    twist_class: Any = load_message_class("geometry_msgs/Twist")
    commands = JoyCommands(
        _axis_map(node, "linear", 1, LINEAR, (0.5, 1.0)),
        _axis_map(node, "angular", 0, ANGULAR, (0.5, None)),
        int(number(node, "enable_button", 0)),
        int(number(node, "enable_turbo_button", -1)),
    )
    timeout_s = checked_number(node, "joy_timeout", -1.0, least=-math.inf)
    silence = JoySilence(None if timeout_s < 0 else timeout_s or math.inf)
    topic = VelocityOutput(node, "cmd_vel")

    def steer(joy: Any) -> None:
        topic.silence_s = silence.after(joy.axes, joy.buttons)
        command = commands.command(joy.axes, joy.buttons)
        if command is None:
            return
        twist = twist_class()
        linear, angular = command
        twist.linear.x, twist.linear.y, twist.linear.z = (linear[name] for name in LINEAR)
        twist.angular.z, twist.angular.y, twist.angular.x = (angular[name] for name in ANGULAR)
        topic.publish(twist)

    topic.follow(subscribe(node, "joy", "sensor_msgs/Joy", steer))
    log.info("Teleop enable button %i.", commands.enable_button)
    if commands.turbo_button >= 0:
        log.info("Turbo on button %i.", commands.turbo_button)
    for kind, axis_map in (("Linear", commands.linear), ("Angular", commands.angular)):
        for name, axis in axis_map.axes.items():
            log.info("%s axis %s on %i at scale %f.", kind, name, axis, axis_map.scales.get(name, 0.0))


def _axis_map(
    node: Node, kind: str, axis: int, known: Sequence[str], usual: tuple[float, float | None]
) -> AxisMap:
    """Return the axes for the linear or the angular velocity.

    `usual` contains the default scale and the default turbo scale. If the latter is None, the turbo scale
    defaults to the normal scale.
    """

    def read(name: str, value: Any) -> dict[str, float]:
        return by_direction(raw(node, name, value), f"~{name}", known[0], known)

    scales = read(f"scale_{kind}", usual[0])
    turbo = scales if usual[1] is None else usual[1]
    return AxisMap(read(f"axis_{kind}", axis), scales, read(f"scale_{kind}_turbo", turbo))
