"""map_server and map_saver: a map is served, requested, replaced and saved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.ros import RosSystem

OccupancyGrid: Any = load_message_class("nav_msgs/OccupancyGrid")
YAML = """image: {name}.pgm
resolution: 0.5
origin: [1.0, 2.0, 1.5707963]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
ASK = """import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, LoadMap
rospy.init_node("ask")
grid = rospy.wait_for_message("map", OccupancyGrid, timeout=30)
info = rospy.wait_for_message("map_metadata", MapMetaData, timeout=30)
print(grid.header.frame_id, info.width, info.height, info.resolution, list(grid.data), info == grid.info)
print("%.3f %.3f" % (info.origin.position.y, info.origin.orientation.z))
rospy.wait_for_service("static_map", 30)
print(rospy.ServiceProxy("static_map", GetMap)().map == grid)
change = rospy.ServiceProxy("change_map", LoadMap)
print([change(name).result for name in ("other.yaml", "nowhere.yaml", "bad.yaml", "broken.yaml")])
print(list(rospy.wait_for_message("map", OccupancyGrid, timeout=30).data))
"""


def write_map(folder: Path, name: str, pixels: bytes) -> None:
    (folder / f"{name}.yaml").write_text(YAML.format(name=name))
    (folder / f"{name}.pgm").write_bytes(b"P5\n%d 1\n255\n" % len(pixels) + pixels)


def test_a_map_is_served_and_saved(ros: RosSystem) -> None:
    write_map(ros.home, "map", b"\x00\xcd\xff")
    write_map(ros.home, "other", b"\xff")
    write_map(ros.home, "broken", b"")
    (ros.home / "bad.yaml").write_text("image: map.pgm")
    (ros.home / "ask.py").write_text(ASK)
    ros.serve_master()
    server = ros.pipros.start("rosrun", "map_server", "map_server", "map.yaml", "_frame_id:=floor")
    server.wait_for(r"Read a 3 X 1 map @ 0.500 m/cell")
    saved = ros.pipros.run("rosrun", "map_server", "map_saver", "-f", "saved", "--occ", "80", "--free", "20")
    asked = ros.pipros.run("python3", "ask.py", timeout_s=60)
    server.press_ctrl_c()
    server.wait()

    assert asked.stdout == [
        "floor 3 1 0.5 [100, -1, 0] True",
        "2.000 0.707",
        "True",
        "[0, 255, 255, 255]",
        "[0]",
    ], asked.output
    assert saved.returncode == 0, saved.output
    assert (ros.home / "saved.pgm").read_bytes().endswith(b"\n3 1\n255\n\x00\xcd\xfe")
    assert (
        (ros.home / "saved.yaml")
        .read_text()
        .startswith(
            "image: saved.pgm\nresolution: 0.500000\norigin: [1.000000, 2.000000, 1.570796]\nnegate: 0\n"
        )
    )


@pytest.mark.parametrize(
    ("program", "arguments", "complaint"),
    [
        ("map_server", "", "USAGE: map_server <map.yaml>"),
        ("map_server", "nowhere.yaml", "Map_server could not open"),
        ("map_server", "nowhere.pgm 0", "resolution must be a finite number > 0 (m/pixel), got 0"),
        ("map_saver", "-f", "Usage:"),
        ("map_saver", "--occ 0", "threshold_occupied must be between 1 and 100, got 0"),
        ("map_saver", "--free x", "threshold_free must be between 0 and 100, got x"),
        ("map_saver", "--free 80", "threshold_free must be smaller than threshold_occupied"),
    ],
)
def test_wrong_arguments_are_explained(ros: RosSystem, program: str, arguments: str, complaint: str) -> None:
    ros.serve_master()
    ended = ros.pipros.run("rosrun", "map_server", program, *arguments.split())

    assert ended.returncode != 0
    assert complaint in ended.output


@pytest.mark.parametrize(("size", "cells"), [((2, 2), 3), ((2**32 - 1, 2**32 - 1), 0), ((1, 1), 2)])
def test_a_map_without_the_right_number_of_cells_is_not_saved(
    ros: RosSystem, size: tuple[int, int], cells: int
) -> None:
    ros.serve_master()
    saver = ros.pipros.start("rosrun", "map_server", "map_saver", "-f", "saved")
    with Node("broken", environment=Environment(master_uri=ros.master_uri)) as node:
        grid = OccupancyGrid(data=[0] * cells)
        grid.info.width, grid.info.height = size
        node.advertise("/map", OccupancyGrid, latch=True).publish(grid)
        assert saver.wait() == 1, saver.output
    assert f"the map must have {size[0]} X {size[1]} cells, got {cells}" in saver.output
    assert list(ros.home.glob("saved*")) == []
