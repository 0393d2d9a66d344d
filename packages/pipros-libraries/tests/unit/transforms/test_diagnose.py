"""Received transforms: every contradiction is reported once, and nothing else."""

from __future__ import annotations

import math

from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from genpy import Time
from pipros_libraries.transforms.diagnose import (
    ReceivedTransform,
    loops,
    not_normalized,
    of_other_times,
    of_several_senders,
    received_in,
    reparented,
)


def received(
    parent: str, child: str, sender: str = "/base", *, ahead_s: float = 0.0, rotation_length: float = 1.0
) -> ReceivedTransform:
    return ReceivedTransform(parent, child, sender, ahead_s, rotation_length)


def test_a_publisher_without_a_caller_id_is_unknown() -> None:
    message = TFMessage([TransformStamped()])
    message._connection_header = {"type": TFMessage._type}
    assert [each.sender for each in received_in(message, Time())] == ["unknown_publisher"]


HEALTHY = [received("map", "odom", "/slam"), received("odom", "base_link"), received("map", "odom", "/slam")]


def test_nothing_is_found_in_a_healthy_tree() -> None:
    for check in (of_other_times, not_normalized, reparented, of_several_senders, loops):
        assert check(HEALTHY) == []
        assert check([]) == []


def test_the_largest_clock_offset_of_each_sender_is_named() -> None:
    late = [received("a", "b", ahead_s=seconds) for seconds in (0.9, -3.0, 2.0)]
    assert of_other_times(late) == ["receiving transform from [/base] that differed from ROS time by -3.0s"]


def test_a_quaternion_of_another_length_is_named_once() -> None:
    found = not_normalized([received("a", "b", rotation_length=0.0)] * 3)
    assert found == ["rotation from [a] to [b] is not unit length, 0.0"]


def test_each_change_of_parent_is_named_once() -> None:
    assert reparented([received("map", "odom"), received("world", "odom")] * 3) == [
        "reparenting of [odom] to [world] by [/base]",
        "reparenting of [odom] to [map] by [/base]",
    ]


def test_each_change_of_sender_is_named_once() -> None:
    assert of_several_senders([received("map", "odom", "/one"), received("map", "odom", "/other")] * 2) == [
        "node [/other] publishing transform [odom] with parent [map] already published by node [/one]",
        "node [/one] publishing transform [odom] with parent [map] already published by node [/other]",
    ]


def test_each_frame_of_a_loop_is_named_and_those_below_it_are_not() -> None:
    found = loops([received("a", "b"), received("b", "a"), received("a", "leaf"), received("own", "own")])
    assert found == [
        "Frame b is in a loop. It's loop has elements:\nb -> a",
        "Frame a is in a loop. It's loop has elements:\na -> b",
        "Frame own is in a loop. It's loop has elements:\nown",
    ]


def test_names_of_peers_cannot_forge_lines() -> None:
    (found,) = not_normalized([received("a", "b\nERROR", rotation_length=2.0)])
    assert "\n" not in found


def test_a_quaternion_with_nan_is_not_a_rotation() -> None:
    (found,) = not_normalized([received("a", "b", rotation_length=math.nan)])
    assert found.endswith("is not unit length, nan")
