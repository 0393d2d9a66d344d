"""Function that transforms point clouds, registered with tf2_ros."""

from __future__ import annotations

from typing import Any

from sensor_msgs.msg import PointCloud2
from sensor_msgs.point_cloud2 import create_cloud as create_cloud
from sensor_msgs.point_cloud2 import read_points as read_points

import tf2_ros
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.transforms.messages import pose_of_transform
from pipros_libraries.transforms.pose import transform_point
from tf2_geometry_msgs import from_msg_msg as from_msg_msg
from tf2_geometry_msgs import to_msg_msg as to_msg_msg
from tf2_geometry_msgs import transform_to_kdl as transform_to_kdl

_star_names(__name__, "PyKDL rospy")


def do_transform_cloud(cloud: PointCloud2, transform: Any) -> PointCloud2:
    """Apply the transform to a cloud whose first three fields are x, y and z.

    Other fields keep their values. The result is unorganised (one row of points), like the results of
    `create_cloud`.
    """
    frame = pose_of_transform(transform.transform)
    # The transformed origin and the transformed unit points on the axes give the columns of the matrix.
    origin, *ends = (transform_point(frame, at) for at in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)))
    ox, oy, oz = origin
    (a, d, g), (b, e, h), (c, f, i) = ((end[0] - ox, end[1] - oy, end[2] - oz) for end in ends)
    points = (
        (a * x + b * y + c * z + ox, d * x + e * y + f * z + oy, g * x + h * y + i * z + oz, *more)
        for x, y, z, *more in read_points(cloud)
    )
    return create_cloud(transform.header, cloud.fields, list(points))


tf2_ros.ConvertRegistration().add_to_msg(PointCloud2, to_msg_msg)
tf2_ros.ConvertRegistration().add_from_msg(PointCloud2, from_msg_msg)
tf2_ros.TransformRegistration().add(PointCloud2, do_transform_cloud)
