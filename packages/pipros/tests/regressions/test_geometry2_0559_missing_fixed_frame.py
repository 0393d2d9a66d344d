"""geometry2#559: the error about a missing fixed frame named another frame."""

from __future__ import annotations

import pytest
from geometry_msgs.msg import TransformStamped

import rospy
import tf2_ros


def test_the_error_names_the_fixed_frame() -> None:
    buffer = tf2_ros.BufferCore(rospy.Duration(10))
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "map", "base"
    transform.transform.rotation.w = 1
    buffer.set_transform_static(transform, "test")
    at = rospy.Time(1)
    for frames, missing in (
        (("map", "base", "gone"), "fixed_frame"),
        (("map", "gone", "map"), "source_frame"),
    ):
        target, source, fixed = frames
        with pytest.raises(
            tf2_ros.LookupException, match=f'"gone" passed to lookupTransform argument {missing}'
        ):
            buffer.lookup_transform_full_core(target, at, source, at, fixed)
