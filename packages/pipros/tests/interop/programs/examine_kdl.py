"""Random points in another frame: as vectors of PyKDL by tf2_kdl, or as messages by tf2_geometry_msgs."""

from __future__ import annotations

import json
import sys

import numpy as np
from geometry_msgs.msg import PointStamped, TransformStamped

import tf2_ros

BY_KDL = sys.argv[1] == "kdl"
if BY_KDL:
    import PyKDL

    import tf2_kdl
else:
    import tf2_geometry_msgs  # noqa: F401 # registers its types

rng = np.random.RandomState(1)
found = {}
for number in range(50):
    transform, point, buffer = TransformStamped(), PointStamped(), tf2_ros.Buffer(debug=False)
    transform.header.frame_id, transform.child_frame_id, point.header.frame_id = "map", "tool", "tool"
    turn = rng.standard_normal(4)
    rotation, position = transform.transform.rotation, transform.transform.translation
    rotation.x, rotation.y, rotation.z, rotation.w = turn / np.linalg.norm(turn)
    position.x, position.y, position.z = rng.uniform(-5, 5, 3)
    point.point.x, point.point.y, point.point.z = rng.uniform(-5, 5, 3)
    buffer.set_transform_static(transform, "test")
    if BY_KDL:
        vector = tf2_kdl.from_msg_vector(point)
        moved = tf2_kdl.to_msg_vector(buffer.transform(vector, "map"))
        again = tf2_ros.convert(buffer.transform(point, "map", new_type=PyKDL.Vector), PointStamped)
        assert np.allclose(*([p.point.x, p.point.y, p.point.z] for p in (again, moved)), rtol=0, atol=1e-9)
        assert tf2_kdl.convert_vector(vector) == vector
        frame = PyKDL.Frame(PyKDL.Rotation.RPY(1, 2, 3), PyKDL.Vector(1, 2, 3))
        assert tf2_kdl.do_transform_frame(frame, transform).header.frame_id == "map"
        twist = tf2_kdl.do_transform_twist(PyKDL.Twist(vector, vector), transform)
        wrench = tf2_kdl.do_transform_wrench(PyKDL.Wrench(vector, vector), transform)
        assert list(twist.rot) == list(wrench.force)
    else:
        moved = buffer.transform(point, "map")
    found[str(number)] = [moved.header.frame_id, moved.point.x, moved.point.y, moved.point.z]
print(json.dumps(found))
