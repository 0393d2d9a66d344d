"""`StaticTransformBroadcaster`, which publishes transforms that never change."""

from __future__ import annotations

from threading import Lock
from typing import Any

from tf2_msgs.msg import TFMessage

import rospy
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "geometry_msgs.msg:TransformStamped")


class StaticTransformBroadcaster:
    """Latched publisher of transforms on `/tf_static`.

    Each message contains the latest transform of every child frame sent so far, so that late subscribers
    receive all of them. Threads may send at the same time.
    """

    def __init__(self) -> None:
        self.pub_tf = rospy.Publisher("/tf_static", TFMessage, queue_size=100, latch=True)
        self._lock = Lock()
        self._sent: dict[str, Any] = {}

    def sendTransform(self, transform: Any) -> None:
        """Publish a TransformStamped, or a list of them, together with all transforms sent before."""
        with self._lock:
            for each in transform if isinstance(transform, list) else [transform]:
                self._sent[each.child_frame_id] = each
            self.pub_tf.publish(TFMessage(list(self._sent.values())))
