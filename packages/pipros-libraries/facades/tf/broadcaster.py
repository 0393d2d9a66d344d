"""tf's `TransformBroadcaster`, which publishes transforms given as plain numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

from pipros.basics.lazy_names import star_names as _star_names
from tf2_ros.transform_broadcaster import TransformBroadcaster as Tf2Broadcaster

if TYPE_CHECKING:
    from pipros.msg.stub_types import Indexable

_star_names(__name__, "geometry_msgs tf2_ros")


class TransformBroadcaster:
    """Publisher of transforms on `/tf`. `queue_size` is ignored, as in Noetic."""

    def __init__(self, queue_size: int = 100) -> None:  # noqa: ARG002
        self.tf2_broadcaster = Tf2Broadcaster()

    def sendTransform(
        self, translation: Indexable, rotation: Indexable, time: Any, child: str, parent: str
    ) -> None:
        """Publish the pose of `child` relative to `parent`.

        Args:
            translation: position (x, y, z) in metres, such as a tuple or a numpy array.
            rotation: quaternion (x, y, z, w).
        """
        x, y, z = translation[0], translation[1], translation[2]
        quaternion = Quaternion(rotation[0], rotation[1], rotation[2], rotation[3])
        header = Header(stamp=time, frame_id=parent)
        self.sendTransformMessage(TransformStamped(header, child, Transform(Vector3(x, y, z), quaternion)))

    def sendTransformMessage(self, transform: TransformStamped) -> None:
        """Publish a TransformStamped."""
        self.tf2_broadcaster.sendTransform([transform])
