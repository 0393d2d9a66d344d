"""`TransformBroadcaster`, which publishes transforms that change over time."""

from __future__ import annotations

from typing import Any

from tf2_msgs.msg import TFMessage

import rospy
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "geometry_msgs.msg:TransformStamped")


class TransformBroadcaster:
    """Publisher of transforms on `/tf`."""

    def __init__(self) -> None:
        self.pub_tf = rospy.Publisher("/tf", TFMessage, queue_size=100)

    def sendTransform(self, transform: Any) -> None:
        """Publish a TransformStamped, or a list of them, in one message."""
        self.pub_tf.publish(TFMessage(transform if isinstance(transform, list) else [transform]))
