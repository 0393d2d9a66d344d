"""`mimic`: makes a turtle repeat the movements of another turtle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.velocities import SILENCE_S, VelocityOutput


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `mimic`, which publishes the velocities in `input/pose` as commands on `output/cmd_vel`.

    Users remap the namespaces `input` and `output`, not the topics in them.
    """
    pose_class: Any = load_message_class("turtlesim/Pose")
    with roscpp_program("turtle_mimic", "turtlesim", argv) as (node, _):
        commands = VelocityOutput(node, f"{node.resolve('output')}/cmd_vel", silence_s=SILENCE_S)

        def repeat(pose: Any) -> None:
            twist = commands.message()
            twist.linear.x, twist.angular.z = pose.linear_velocity, pose.angular_velocity
            commands.publish(twist)

        node.subscribe(f"{node.resolve('input')}/pose", pose_class, repeat, queue_size=1)
        node.wait_for_shutdown()
    return 0
