"""Launch files of the shape of turtlebot3_navigation and turtlebot3_slam, with pipros_sim as the robot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_robot.navigation import plane
from tests.support.environments import REPOSITORY
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


@pytest.fixture
def node(ros: RosSystem) -> Iterator[Node]:
    ros.serve_master()
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(REPOSITORY / "examples" / "turtlebot3")
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        yield node


def start_robot(ros: RosSystem, lockstep: str) -> None:
    arguments = "headless:=true", f"lockstep:={lockstep}"
    ros.pipros.start("roslaunch", "turtlebot3_bringup", "turtlebot3_robot.launch", *arguments)


def test_turtlebot3_navigation_reaches_a_goal_in_lockstep(ros: RosSystem, node: Node) -> None:
    start_robot(ros, "[amcl, move_base]")
    launched = ros.pipros.start(
        "roslaunch", "turtlebot3_navigation", "turtlebot3_navigation.launch", "open_rviz:=false"
    )
    results: list[Any] = []
    result: Any = load_message_class("move_base_msgs/MoveBaseActionResult")
    node.subscribe("/move_base/result", result, results.append)
    stamped: Any = load_message_class("geometry_msgs/PoseStamped")
    goals = node.advertise("/move_base_simple/goal", stamped, queue_size=1)
    wait_until(lambda: goals.connection_count, 90, lambda: str(launched.output))
    ros.wait_for_publisher("/move_base/result")

    goals.publish(plane.stamped_pose((3.2, 2.0, 1.5), "map", Time(0, 0)))

    wait_until(lambda: results, 120, lambda: str(launched.output))
    assert (results[0].status.status, results[0].status.text) == (3, "Goal reached.")
    launched.press_ctrl_c()
    assert launched.wait() == 0


@pytest.mark.usefixtures("node")
def test_turtlebot3_slam_publishes_a_map_that_map_saver_saves(ros: RosSystem) -> None:
    start_robot(ros, "[]")
    launched = ros.pipros.start("roslaunch", "turtlebot3_slam", "turtlebot3_slam.launch", "open_rviz:=false")
    ros.wait_for_publisher("/map")
    saved = ros.pipros.run("rosrun", "map_server", "map_saver", "-f", str(ros.home / "map"), timeout_s=120)
    assert saved.returncode == 0, (saved.output, launched.output)
    assert "resolution: 0.05" in (ros.home / "map.yaml").read_text()
