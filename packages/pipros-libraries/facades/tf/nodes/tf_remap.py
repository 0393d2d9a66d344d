"""`rosrun tf tf_remap`: republish the transforms of `/tf_old` on `/tf` with renamed frames."""

from __future__ import annotations

from typing import Any

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class


def mappings_of(listed: Any) -> dict[str, str]:
    """Return the mapping from old to new frame IDs in the parameter `~mappings`.

    The parameter is a list of dictionaries with the keys `old` and `new`. Incomplete entries are skipped.

    >>> mappings_of([{"old": "base", "new": "robot/base"}, {"old": "x"}, "y"])
    {'base': 'robot/base'}
    """
    if not isinstance(listed, list):
        return {}
    pairs = [(item.get("old"), item.get("new")) for item in listed if isinstance(item, dict)]
    return {str(old): str(new) for old, new in pairs if old is not None and new is not None}


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node("tf_remapper")
    mappings = mappings_of(rospy.get_param("~mappings", []))
    print("Applying the following mappings to incoming tf frame ids", mappings, flush=True)
    kind: Any = load_message_class("tf2_msgs/TFMessage")
    publisher = rospy.Publisher("/tf", kind, queue_size=100)

    def republish(message: Any) -> None:
        for transform in message.transforms:
            parent, child = transform.header.frame_id, transform.child_frame_id
            transform.header.frame_id = mappings.get(parent, parent)
            transform.child_frame_id = mappings.get(child, child)
        publisher.publish(message)

    rospy.Subscriber("/tf_old", kind, republish)
    rospy.spin()
    return 0
