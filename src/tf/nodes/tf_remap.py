"""`rosrun tf tf_remap`: publishes the transforms of `/tf_old` on `/tf` with other names of frames."""

from __future__ import annotations

from typing import Any

import rospy
from pipros.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class


def mappings_of(listed: Any) -> dict[str, str]:
    """New names by old ones, of the parameter `~mappings`: dictionaries with `old` and `new`.

    What has not both is left out.

    >>> mappings_of([{"old": "base", "new": "robot/base"}, {"old": "x"}, "y"])
    {'base': 'robot/base'}
    """
    if not isinstance(listed, list):
        return {}
    pairs = [(item.get("old"), item.get("new")) for item in listed if isinstance(item, dict)]
    return {str(old): str(new) for old, new in pairs if old is not None and new is not None}


@exits_after_ctrl_c()
def main() -> int:
    """Runs until the node is ended. Returns the exit code."""
    rospy.init_node("tf_remapper")
    mappings = mappings_of(rospy.get_param("~mappings", []))
    print("Applying the following mappings to incoming tf frame ids", mappings, flush=True)
    kind: Any = load_message_class("tf2_msgs/TFMessage")
    publisher = rospy.Publisher("/tf", kind, queue_size=100)

    def pass_on(message: Any) -> None:
        for transform in message.transforms:
            parent, child = transform.header.frame_id, transform.child_frame_id
            transform.header.frame_id = mappings.get(parent, parent)
            transform.child_frame_id = mappings.get(child, child)
        publisher.publish(message)

    rospy.Subscriber("/tf_old", kind, pass_on)
    rospy.spin()
    return 0
