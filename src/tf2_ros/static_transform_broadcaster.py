"""`StaticTransformBroadcaster`: sends transforms that never change."""

from __future__ import annotations

from threading import Lock
from typing import Any

from tf2_msgs.msg import TFMessage

import rospy
from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "geometry_msgs.msg:TransformStamped")


class StaticTransformBroadcaster:
    """Sends transforms on `/tf_static`, also to those who begin to listen later.

    All that were sent stay: the newest of each child frame.
    """

    def __init__(self) -> None:
        self.pub_tf = rospy.Publisher("/tf_static", TFMessage, queue_size=100, latch=True)
        self._lock = Lock()
        self._sent: dict[str, Any] = {}

    def sendTransform(self, transform: Any) -> None:
        """Sends a TransformStamped, or a list of them, together with those sent before."""
        with self._lock:
            for each in transform if isinstance(transform, list) else [transform]:
                self._sent[each.child_frame_id] = each
            self.pub_tf.publish(TFMessage(list(self._sent.values())))
