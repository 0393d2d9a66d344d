"""geometry2: a loop of frames or a very long chain of them blocked or crashed the lookups of all others."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from geometry_msgs.msg import TransformStamped

import rospy
import tf2_ros


def buffer(edges: Iterable[tuple[str, str]]) -> tf2_ros.BufferCore:
    made = tf2_ros.BufferCore(rospy.Duration(10))
    for parent, child in edges:
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.header.stamp = parent, rospy.Time(5)
        transform.transform.translation.x = transform.transform.rotation.w = 1.0
        made.set_transform(transform, "test")
    return made


def test_a_loop_is_an_error_for_what_depends_on_it_only() -> None:
    made = buffer([("a", "b"), ("b", "c"), ("c", "a"), ("map", "base"), ("base", "laser")])
    with pytest.raises(tf2_ros.LookupException, match="contains a loop"):
        made.lookup_transform_core("map", "a", rospy.Time(0))
    found = made.lookup_transform_core("map", "laser", rospy.Time(0))
    assert found.transform.translation.x == 2.0


@pytest.mark.parametrize(("length", "is_found"), [(1000, True), (1500, False)])
def test_chains_of_a_thousand_frames_are_followed(length: int, is_found: bool) -> None:
    made = buffer((f"f{number}", f"f{number + 1}") for number in range(length))
    assert made.can_transform_core("f0", f"f{length}", rospy.Time(0))[0] == is_found
    assert made.can_transform_core("f0", "f1", rospy.Time(0))[0]
