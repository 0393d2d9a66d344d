"""`rosrun tf2_ros buffer_server`: answers questions about the transforms of the graph."""

from __future__ import annotations

import rospy
from pipros.interrupts import exits_after_ctrl_c
from tf2_ros.buffer import Buffer
from tf2_ros.buffer_server import BufferServer
from tf2_ros.transform_listener import TransformListener


@exits_after_ctrl_c()
def main() -> int:
    """Serves until the node is ended. Returns the exit code."""
    rospy.init_node("tf_buffer")
    length = rospy.get_param("~buffer_size", 120.0)
    buffer = Buffer(rospy.Duration.from_sec(float(length)), debug=bool(rospy.get_param("~debug", False)))
    listener = TransformListener(buffer)
    server = BufferServer(buffer, "tf2_buffer_server", auto_start=False)
    server.start()
    rospy.spin()
    listener.unregister()
    return 0
