"""What a user saved before is still there after the disk was too full to save it again."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.ros import RosSystem

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a limit stands for the full disk")

FULL = "ulimit -f 1; exec env PYTHONDONTWRITEBYTECODE=1 {}"  # files of at most 1,024 bytes

OccupancyGrid: Any = load_message_class("nav_msgs/OccupancyGrid")


def only(folder: Path, pattern: str) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.glob(pattern)}


def test_rosparam_dump_keeps_the_old_file(ros: RosSystem) -> None:
    ros.serve_master()
    assert ros.pipros.run("rosparam", "set", "/many", "x" * 5000).returncode == 0
    (ros.home / "old.yaml").write_text("kept: 1\n")

    dumped = ros.pipros.run("bash", "-c", FULL.format("rosparam dump old.yaml"))

    assert dumped.returncode == 1
    assert "ERROR: cannot write [old.yaml]: File too large" in dumped.output
    assert only(ros.home, "old*") == {"old.yaml": "kept: 1\n"}


def test_map_saver_keeps_both_old_files(ros: RosSystem) -> None:
    ros.serve_master()
    for name in ("old.pgm", "old.yaml"):
        (ros.home / name).write_text("kept")
    saver = ros.pipros.start("bash", "-c", FULL.format("rosrun map_server map_saver -f old"))
    with Node("map", environment=Environment(master_uri=ros.master_uri)) as node:
        grid = OccupancyGrid(data=[0] * 5000)
        grid.info.width, grid.info.height = 100, 50
        node.advertise("/map", OccupancyGrid, latch=True).publish(grid)
        assert saver.wait() == 1, saver.output

    assert "Couldn't save map file to old.pgm: File too large" in saver.output
    assert only(ros.home, "old*") == {"old.pgm": "kept", "old.yaml": "kept"}
