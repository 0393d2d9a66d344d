"""rosbag: an invalid message spoiled those written after it, and a look at the messages so far the bag."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String, UInt8

import rosbag
import rospy
from genpy import SerializationError


def values(bag: Any) -> list[int]:
    return [message.data for _, message, _ in bag.read_messages()]


def test_messages_after_an_invalid_one_are_written(tmp_path: Path) -> None:
    path = str(tmp_path / "run.bag")
    with rosbag.Bag(path, "w") as bag:
        bag.write("/a", UInt8(1), rospy.Time(1))
        for topic, message in (("/a", UInt8(300)), ("/a", None), ("/a", "x"), ("/b", String(5))):
            with pytest.raises((ValueError, AttributeError, SerializationError)):
                bag.write(topic, message, rospy.Time(2))
        for value in (3, 4):
            bag.write("/a", UInt8(value), rospy.Time(value))
    with rosbag.Bag(path) as bag:
        assert values(bag) == [1, 3, 4]


def test_a_bag_can_be_read_while_it_is_written(tmp_path: Path) -> None:
    path = str(tmp_path / "run.bag")
    with rosbag.Bag(path, "w") as bag:
        for value in (1, 2, 3):
            bag.write("/a", UInt8(value), rospy.Time(value))
            assert values(bag) == [*range(1, value + 1)]
            assert bag.get_message_count() == value
    with rosbag.Bag(path) as bag:
        assert values(bag) == [1, 2, 3]


def test_the_first_and_the_last_time_are_kept(tmp_path: Path) -> None:
    path = str(tmp_path / "run.bag")
    times = [rospy.Time(0), rospy.Time(0, 1), rospy.Time(2**32 - 1, 999_999_999)]
    with rosbag.Bag(path, "w") as bag:
        for time in times:
            bag.write("/a", UInt8(1), time)
    with rosbag.Bag(path) as bag:
        assert [time for _, _, time in bag.read_messages()] == times
        assert (bag.get_start_time(), bag.get_end_time()) == (0.0, 2.0**32)
