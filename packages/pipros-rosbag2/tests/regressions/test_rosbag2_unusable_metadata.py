"""rosbag2: an empty metadata.yaml, or one with old names of files, made a bag unreadable."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from std_msgs.msg import Int32

import rosbag
import rospy
from pipros_tools.cli.rosbag import main


@pytest.mark.parametrize("fault", ["empty", "cut", "a list", "binary", "too large", "renamed file"])
def test_the_files_of_a_bag_with_unusable_metadata_are_read(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with rosbag.Bag("first.bag", "w") as bag:
        bag.write("/number", Int32(7), rospy.Time(1))
    assert main(["convert", "--ros2", "humble", "first.bag", "run"]) == 0
    metadata = Path("run/metadata.yaml")
    content = metadata.read_bytes()
    contents = {"empty": b"", "cut": content[:90], "a list": b"- 1\n", "binary": b"\xff"}
    metadata.write_bytes(contents.get(fault, content))
    if fault == "too large":
        os.truncate(metadata, 1 << 32)
    if fault == "renamed file":
        Path("run/run_0.db3").rename("run/monday.db3")
    capsys.readouterr()

    assert main(["convert", "run", "out.bag"]) == 1
    warning = capsys.readouterr().err
    assert str(metadata) in warning
    assert "all files in the folder are read instead" in warning
    with rosbag.Bag("out.bag") as bag:
        assert [message.data for _, message, _ in bag.read_messages()] == [7]
