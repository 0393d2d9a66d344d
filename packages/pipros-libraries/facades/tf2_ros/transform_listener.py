"""`TransformListener`, which fills a buffer from `/tf` and `/tf_static`."""

from __future__ import annotations

from threading import Lock
from typing import Any

from tf2_msgs.msg import TFMessage

import rospy
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "threading")


class TransformListener:
    """Subscriber that fills `buffer` from `/tf` and `/tf_static` until `unregister` is called.

    If the clock jumps back, the buffer is cleared except for static transforms.
    """

    def __init__(
        self, buffer: Any, queue_size: int | None = None, buff_size: int = 65536, tcp_nodelay: bool = False
    ) -> None:
        self.buffer = buffer
        self.last_update = rospy.Time.now()
        self.last_update_lock = Lock()
        more: dict[str, Any] = {"queue_size": queue_size, "buff_size": buff_size, "tcp_nodelay": tcp_nodelay}
        self.tf_sub = rospy.Subscriber("/tf", TFMessage, self.callback, **more)
        self.tf_static_sub = rospy.Subscriber("/tf_static", TFMessage, self.static_callback, **more)

    def __del__(self) -> None:
        if hasattr(self, "tf_static_sub"):
            self.unregister()

    def unregister(self) -> None:
        """Unsubscribe from `/tf` and `/tf_static`."""
        self.tf_sub.unregister()
        self.tf_static_sub.unregister()

    def check_for_reset(self) -> None:
        """Clear the buffer if the clock has jumped back since the last call."""
        with self.last_update_lock:
            now, before = rospy.Time.now(), self.last_update
            self.last_update = now
            if now < before:
                seconds = (before - now).to_sec()
                rospy.logwarn("Clock jumped back by %f s: clearing the transform buffer.", seconds)
                self.buffer.clear()

    def callback(self, data: Any) -> None:
        """Handle a message on `/tf`. Runs in the connection's thread."""
        self.check_for_reset()
        sender = data._connection_header.get("callerid", "default_authority")
        insert = self.buffer.set_transform
        for transform in data.transforms:
            insert(transform, sender)

    def static_callback(self, data: Any) -> None:
        """Handle a message on `/tf_static`. Runs in the connection's thread."""
        self.check_for_reset()
        sender = data._connection_header.get("callerid", "default_authority")
        for transform in data.transforms:
            self.buffer.set_transform_static(transform, sender)
