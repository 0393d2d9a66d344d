"""`pipros sim-for` with launch files in the shapes of public ones: wrappers start, and robots reach goals."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_robot.navigation import plane
from tests.support.environments import file_of_tests
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LAUNCH_FILES = file_of_tests("support/launch_sets")
GOALS = {
    "burger": ((3.2, 2.0, 1.5), "[amcl, move_base]"),
    "clearpath": ((4.0, 4.0, 3.0), "[]"),
    "kobuki": ((3.2, 2.0, 1.5), "[]"),
}
"""Goals on the map, and the members of the lockstep: all nodes between the scans and the commands."""


@pytest.mark.parametrize("name", GOALS)
def test_the_robot_of_a_wrapper_reaches_a_goal(ros: RosSystem, name: str) -> None:
    goal, members = GOALS[name]
    ros.serve_master()
    written = ros.pipros.run("pipros", "sim-for", LAUNCH_FILES / f"{name}.launch")
    assert written.returncode == 0, written.output
    wrapper = ros.home / "wrapper.launch"
    wrapper.write_text("\n".join(written.stdout))
    launched = ros.pipros.start("roslaunch", wrapper, "headless:=true", f"lockstep:={members}")
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        results, truth = Inbox(), Inbox()
        node.subscribe("/base_pose_ground_truth", load_message_class("nav_msgs/Odometry"), truth)
        result: Any = load_message_class("move_base_msgs/MoveBaseActionResult")
        node.subscribe("/move_base/result", result, results)
        stamped: Any = load_message_class("geometry_msgs/PoseStamped")
        goals = node.advertise("/move_base_simple/goal", stamped, queue_size=1)
        wait_until(lambda: goals.connection_count, 90, lambda: str(launched.output))
        ros.wait_for_publisher("/move_base/result")

        goals.publish(plane.stamped_pose(goal, "map", Time(0, 0)))

        wait_until(lambda: results.messages, 120, lambda: str(launched.output))
        status = results.messages[0].status
        assert (status.status, status.text) == (3, "Goal reached."), launched.output
        place = truth.messages[-1].pose.pose.position
        assert (place.x, place.y) == pytest.approx(goal[:2], abs=0.5)
    launched.press_ctrl_c()
    assert launched.wait() == 0
    assert "Traceback" not in launched.output


@pytest.mark.parametrize(("name", "scan", "frame", "reader"), [
    ("in_a_group", "/robot1/laser/scan", "robot1/base_scan", "/robot1/amcl"),
    ("slam", "/base_scan", "base_scan", "/slam_gmapping"),
])  # fmt: skip
def test_the_nodes_of_a_wrapper_get_their_scans(
    ros: RosSystem, name: str, scan: str, frame: str, reader: str
) -> None:
    ros.serve_master()
    written = ros.pipros.run("pipros", "sim-for", LAUNCH_FILES / f"{name}.launch")
    wrapper = ros.home / "wrapper.launch"
    wrapper.write_text("\n".join(written.stdout))
    launched = ros.pipros.start("roslaunch", wrapper, "headless:=true")
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        scans, maps = Inbox(), Inbox()
        node.subscribe(scan, load_message_class("sensor_msgs/LaserScan"), scans)
        node.subscribe("/map", load_message_class("nav_msgs/OccupancyGrid"), maps)
        assert scans.wait()[0].header.frame_id == frame
        wait_until(lambda: reader in ros.subscribers(scan), 60, lambda: str(launched.output))
        assert max(maps.wait()[0].data) == 100  # from map_server or, with slam_gmapping, from the scans
    launched.press_ctrl_c()
    assert launched.wait() == 0


def test_a_launch_file_that_cannot_be_read_is_named(ros: RosSystem) -> None:
    (ros.home / "bad.launch").write_text("<launch><nope></launch>")
    ended = ros.pipros.run("pipros", "sim-for", ros.home / "bad.launch")

    assert ended.returncode == 1
    assert "bad.launch" in ended.output
    assert "Traceback" not in ended.output
    assert ros.pipros.run("pipros", "sim-for", "a", "b", "c").returncode == 2


def test_no_command_but_xacro_and_cat_is_run(ros: RosSystem) -> None:
    file = ros.home / "x.launch"
    file.write_text(f"<launch><param name='robot_description' command='touch {ros.home}/ran'/></launch>")
    written = ros.pipros.run("pipros", "sim-for", file)
    assert "/robot_description: its command is not run, because only xacro and cat are" in written.output
    assert not (ros.home / "ran").exists()
