"""`teleop_twist_keyboard`: uses keys in a terminal to steer any robot that subscribes to `cmd_vel`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Final

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.terminals import single_keys
from pipros.node import Node
from pipros.node.clock import stamp
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import InvalidParameter, raw
from pipros_libraries.nodes.velocities import VelocityOutput, checked_number, checked_rate
from pipros_libraries.teleoperation.key_bindings import STOP, KeyedMotion
from pipros_libraries.teleoperation.pressed_keys import pressed_keys

TEXT: Final = f"""\
Keys in this terminal steer the robot on cmd_vel.
{"-" * 27}
   u    i    o      left and ahead    ahead    right and ahead
   j    k    l      turn left         stop     turn right
   m    ,    .      back

With Shift, for robots that move sideways:
{"-" * 27}
   U    I    O
   J    K    L
   M    <    >

t, b    up, down
q, z    both speeds 10% higher, lower
w, x    only the linear speed
e, c    only the angular speed
Any other key stops. CTRL-C to quit
"""
TEXT_AFTER: Final = 15
"""Number of speed changes after which the help text is printed again."""
CTRL_C: Final = "\x03"


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `teleop_twist_keyboard` until Ctrl-C is pressed, the input ends, or the node is shut down.

    Return 1 if a parameter is invalid.
    """
    with roscpp_program("teleop_twist_keyboard", "teleop_twist_keyboard", argv) as (node, log):
        try:
            motion = _motion(node)
            rate_hz = checked_number(node, "repeat_rate", 0.0)
            repeat_s = 1.0 / checked_rate("~repeat_rate", rate_hz) if rate_hz else math.inf
            key_s = checked_number(node, "key_timeout", 0.5) or math.inf
        except InvalidParameter as error:
            log.critical("%s", error)
            return 1
        publish = _publisher(node, motion)

        def stop() -> None:
            motion.press("")
            publish()

        node.on_shutdown(stop)
        print(TEXT)
        print(_speeds(motion), flush=True)
        with single_keys(of_launcher=True):
            _steer(node, motion, publish, repeat_s, key_s)
    return 0


def _motion(node: Node) -> KeyedMotion:
    limit, turn_limit = (checked_number(node, f"{kind}_limit", 1000.0) for kind in ("speed", "turn"))
    speed, turn = checked_number(node, "speed", 0.5), checked_number(node, "turn", 1.0)
    return KeyedMotion(min(speed, limit), min(turn, turn_limit), limit, turn_limit)


def _steer(
    node: Node, motion: KeyedMotion, publish: Callable[[], None], repeat_s: float, key_s: float
) -> None:
    """Publish the motion after each key press and every `repeat_s` seconds.

    The robot stops if no key is pressed for `key_s` seconds.
    """
    changes = 0
    pressed_s = published_s = time.monotonic()
    for key in pressed_keys(node):
        now_s = time.monotonic()
        if key == CTRL_C:
            return
        if key:
            pressed_s = now_s
            if motion.press(key):
                changes += 1
                if changes % TEXT_AFTER == 0:
                    print(TEXT)
                print(_speeds(motion), flush=True)
        elif motion.direction != STOP and now_s - pressed_s >= key_s:
            motion.press("")
        elif now_s - published_s < repeat_s:
            continue
        published_s = now_s
        publish()


def _speeds(motion: KeyedMotion) -> str:
    return f"currently:\tspeed {motion.speed}\tturn {motion.turn} "


def _publisher(node: Node, motion: KeyedMotion) -> Callable[[], None]:
    """Return a function that publishes the motion, with a timestamp if `~stamped` is true."""
    is_stamped = raw(node, "stamped", False) is True
    frame = str(raw(node, "frame_id", ""))
    topic = VelocityOutput(node, "cmd_vel", f"geometry_msgs/{'TwistStamped' if is_stamped else 'Twist'}")

    def publish() -> None:
        message = topic.message()
        twist = message.twist if is_stamped else message
        if is_stamped:
            message.header.stamp, message.header.frame_id = stamp(node.clock), frame
        twist.linear.x, twist.linear.y, twist.linear.z = motion.linear
        twist.angular.z = motion.angular
        topic.publish(message)

    return publish
