"""tf's `TransformerROS` and `TransformListener`, which transform messages into other frames."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    Pose,
    PoseStamped,
    Quaternion,
    QuaternionStamped,
    Vector3,
    Vector3Stamped,
)
from sensor_msgs.msg import PointCloud
from std_msgs.msg import Header

import tf2_ros
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.transforms.messages import pose_of, vector_of
from pipros_libraries.transforms.pose import Pose as Numbers
from pipros_libraries.transforms.pose import compose_via_matrices, normalized, rotate, transform_point
from tf.transformer import Transformer as Transformer
from tf.transformer import strip_leading_slash as strip_leading_slash

_star_names(__name__, "geometry_msgs numpy rospy sensor_msgs tf.transformations yaml")


def xyz_to_mat44(pos: Any) -> Any:
    """Convert a Point or Vector3 message to a 4x4 translation matrix. Requires numpy."""
    from tf import transformations

    return transformations.translation_matrix((pos.x, pos.y, pos.z))


def xyzw_to_mat44(ori: Any) -> Any:
    """Convert a Quaternion message to a 4x4 rotation matrix. Requires numpy."""
    from tf import transformations

    return transformations.quaternion_matrix((ori.x, ori.y, ori.z, ori.w))


class TransformerROS(Transformer):
    """Transformer for stamped messages. Results keep the timestamp of the input.

    Methods raise the same errors as `lookupTransform`.
    """

    def asMatrix(self, target_frame: str, hdr: Any) -> Any:
        """Return the 4x4 matrix from the frame of `hdr` to `target_frame` at the time of `hdr`.

        Requires numpy.
        """
        return self.fromTranslationRotation(*self.lookupTransform(target_frame, hdr.frame_id, hdr.stamp))

    def fromTranslationRotation(self, translation: Any, rotation: Any) -> Any:
        """Convert a position (x, y, z) and a quaternion (x, y, z, w) to a 4x4 matrix. Requires numpy."""
        from tf import transformations

        return transformations.translation_matrix(translation) @ transformations.quaternion_matrix(rotation)

    def transformPoint(self, target_frame: str, ps: PointStamped) -> PointStamped:
        """Transform a point to `target_frame`."""
        point = transform_point(normalized(self._frame(target_frame, ps)), vector_of(ps.point))
        return PointStamped(_header(target_frame, ps), Point(*point))

    def transformVector3(self, target_frame: str, v3s: Vector3Stamped) -> Vector3Stamped:
        """Rotate a vector into `target_frame`, without translating it."""
        vector = rotate(normalized(self._frame(target_frame, v3s)), vector_of(v3s.vector))
        return Vector3Stamped(_header(target_frame, v3s), Vector3(*vector))

    def transformQuaternion(self, target_frame: str, ps: QuaternionStamped) -> QuaternionStamped:
        """Transform an orientation to `target_frame`."""
        found = compose_via_matrices(self._frame(target_frame, ps), pose_of(Point(), ps.quaternion))
        return QuaternionStamped(_header(target_frame, ps), Quaternion(*found[3:]))

    def transformPose(self, target_frame: str, ps: PoseStamped) -> PoseStamped:
        """Transform a pose to `target_frame`."""
        pose = pose_of(ps.pose.position, ps.pose.orientation)
        found = compose_via_matrices(self._frame(target_frame, ps), pose)
        return PoseStamped(_header(target_frame, ps), Pose(Point(*found[:3]), Quaternion(*found[3:])))

    def transformPointCloud(self, target_frame: str, point_cloud: PointCloud) -> PointCloud:
        """Transform a point cloud to `target_frame`. The result shares the channels of the input."""
        frame = normalized(self._frame(target_frame, point_cloud))
        points = [Point32(*transform_point(frame, vector_of(point))) for point in point_cloud.points]
        return PointCloud(_header(target_frame, point_cloud), points, point_cloud.channels)

    def _frame(self, target_frame: str, stamped: Any) -> Numbers:
        return self._pose(target_frame, stamped.header.frame_id, stamped.header.stamp)


def _header(target_frame: str, stamped: Any) -> Header:
    return Header(stamp=stamped.header.stamp, frame_id=target_frame)


class TransformListener(TransformerROS):
    """TransformerROS that receives the transforms on `/tf` and `/tf_static`."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._listener = tf2_ros.TransformListener(self._buffer)
        self.setUsingDedicatedThread(True)
