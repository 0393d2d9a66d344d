"""geometry2#467: a transform repeated with the same stamp printed a warning for each message."""

from __future__ import annotations

import io

import pytest
from geometry_msgs.msg import TransformStamped

import rospy
import tf2_ros
from pipros_libraries.transforms import rejections


def repeated(stamp_s: int, x: float, child: str = "base") -> TransformStamped:
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id, made.header.stamp = "map", rospy.Time(stamp_s)
    made.transform.translation.x, made.transform.rotation.w = x, 1.0
    return made


def test_repeated_transforms_are_reported_once_in_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    buffer, shown = tf2_ros.BufferCore(rospy.Duration(10)), io.StringIO()
    monkeypatch.setattr(tf2_ros.BufferCore, "_warning_stream", shown)
    for number in range(300):
        buffer.set_transform(repeated(5, number), "driver")
    buffer.set_transform(repeated(5, 0, "arm"), "driver")
    buffer.set_transform(repeated(5, 0, "arm"), "driver")
    buffer.set_transform(repeated(20, 1), "driver")
    buffer.set_transform(repeated(1, 1), "driver")

    assert [(line.split()[1], line.split()[8]) for line in shown.getvalue().splitlines()[:2]] == [
        ("TF_REPEATED_DATA", "frame"),
        ("TF_REPEATED_DATA", "frame"),
    ]
    assert [line.split()[1] for line in shown.getvalue().splitlines()] == [
        *("TF_REPEATED_DATA", "TF_REPEATED_DATA", "TF_OLD_DATA"),
    ]
    assert buffer.lookup_transform_core("map", "arm", rospy.Time(5)).transform.translation.x == 0


def test_the_next_warning_says_how_many_were_not_shown() -> None:
    now_s, shown = [0.0], list[str]()
    rejected = rejections.Rejections(shown.append, lambda: now_s[0])
    for _ in range(50):
        rejected.add("base", "TF_REPEATED_DATA again")
    now_s[0] = rejections.PERIOD_S
    rejected.add("base", "TF_REPEATED_DATA again")
    for number in range(5000):  # names of frames come from peers
        rejected.add(f"frame{number}", "TF_SELF_TRANSFORM x")
    assert shown[:2] == [
        "TF_REPEATED_DATA again",
        "TF_REPEATED_DATA again (and 49 more since the last warning)",
    ]
    assert len(rejected._quiet) <= 1000
