"""`rosrun topic_tools drop`: drop X of every Y messages on a topic."""

from __future__ import annotations

import threading

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node.any_msg import AnyMsg
from pipros_libraries.topic_tools.rates import Dropping
from topic_tools.nodes.output import Input, Output, base_name

USAGE = """
usage: drop IN_TOPIC X Y [OUT_TOPIC]

 Drop the first X of every Y messages of IN_TOPIC, and republish
 the others on OUT_TOPIC (default: IN_TOPIC_drop).

"""


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    try:
        dropped, of = (int(text) for text in arguments[1:3])
    except ValueError:
        dropped, of = 0, 0
    if len(arguments) not in (3, 4) or dropped < 0 or of < 1:
        print(USAGE)
        return 1
    source = arguments[0]
    rospy.init_node(f"{base_name(source, *arguments[3:])}_drop", anonymous=True)
    output = Output(arguments[3] if len(arguments) == 4 else f"{source.rstrip('/')}_drop")
    rule, turn = Dropping(dropped, of), threading.Lock()

    def pass_on(message: AnyMsg) -> None:
        if output.advertise_like(message, latch=False):
            print(f"advertised as {output.topic}\n", flush=True)
        with turn:
            passes = rule.passes(0, len(message.body))
        if passes:
            output.publish(message)

    Input(source, pass_on).subscribe()
    rospy.spin()
    return 0
