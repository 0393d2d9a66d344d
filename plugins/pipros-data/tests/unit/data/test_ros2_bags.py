"""ROS 2 bags as tables."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from geometry_msgs.msg import Twist
from std_msgs.msg import String

from pipros_data import open_bags
from pipros_rosbag2.distribution import Distribution
from pipros_tools.cli.rosbag import main as rosbag
from tests.support.bags import bag_bytes


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_ros_2_bags_are_read(storage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    twist = Twist()
    twist.linear.x = 1.5
    Path("run.bag").write_bytes(bag_bytes([("/t", twist, 3, 4), ("/s", String("x"), 3, 5)]))
    command = ["convert", "-q", "--ros2", Distribution.JAZZY.value, "--storage", storage, "run.bag", "ros2"]
    assert rosbag(command) == 0

    with open_bags("ros2") as bags:
        assert bags.table("/t")["linear.x"].tolist() == [1.5]
        assert bags.table("/s")["_time"].tolist() == [3_000_000_005]
        assert list(bags.table("/s")["data"]) == ["x"]
    assert rosbag(["table", "ros2", "/t", "-o", "t.csv"]) == 0
    assert len(Path("t.csv").read_text().splitlines()) == 2


def test_what_is_left_out_of_a_ros_2_bag_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("run.bag").write_bytes(bag_bytes([("/t", Twist(), 3, 4), ("/s", String("x"), 3, 5)]))
    command = [
        "convert", "-q", "--ros2", Distribution.HUMBLE.value, "--storage", "sqlite3", "run.bag", "ros2",
    ]  # fmt: skip
    assert rosbag(command) == 0
    with closing(sqlite3.connect(next(Path("ros2").glob("*.db3")))) as database, database:
        database.execute("UPDATE topics SET type = 'lab_msgs/msg/Odd' WHERE name = '/s'")

    with open_bags("ros2") as bags:
        assert repr(bags) == "<Bags of ros2: 1 topics, 1 left out; info() has the reasons>"
        assert "/s</td><td>left out: the type lab_msgs/msg/Odd is unknown" in bags._repr_html_()
