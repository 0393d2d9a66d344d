"""`rosrun tf2_ros buffer_server`: offer transform lookups as an action."""

from __future__ import annotations

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from tf2_ros.buffer import Buffer
from tf2_ros.buffer_server import BufferServer
from tf2_ros.transform_listener import TransformListener


@exits_after_ctrl_c()
def main() -> int:
    """Serve lookups until the node is shut down. Return the exit code."""
    rospy.init_node("tf_buffer")
    length = rospy.get_param("~buffer_size", 120.0)
    buffer = Buffer(rospy.Duration.from_sec(float(length)), debug=bool(rospy.get_param("~debug", False)))
    listener = TransformListener(buffer)
    server = BufferServer(buffer, "tf2_buffer_server", auto_start=False)
    server.start()
    rospy.spin()
    listener.unregister()
    return 0
