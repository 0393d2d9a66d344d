"""`pipros sim-for` with launch files in the shapes of public ones: wrappers start, and robots reach goals."""

import logging
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_robot.navigation import plane
from pipros_robot.navigation.world import NavigationWorld, WorldFailure
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.environments import REPOSITORY, file_of_tests
from tests.support.nodes import Inbox
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LAUNCH_FILES = file_of_tests("support/launch_sets")
GOALS = {
    "burger": ((3.2, 2.0, 1.5), "[amcl, move_base]"),
    "clearpath": ((4.0, 4.0, 3.0), "[]"),
    "kobuki": ((3.2, 2.0, 1.5), "[]"),
}
"""Goals on the map, and the members of the lockstep: all nodes between the scans and the commands."""


def wrapped(ros: RosSystem, name: str, *arguments: str) -> Process:
    """Launch the wrapper that `pipros sim-for` writes for a launch file."""
    ros.serve_master()
    written = ros.pipros.run("pipros", "sim-for", LAUNCH_FILES / f"{name}.launch")
    assert written.returncode == 0, written.output
    (ros.home / "wrapper.launch").write_text("\n".join(written.stdout))
    return ros.pipros.start("roslaunch", ros.home / "wrapper.launch", "headless:=true", *arguments)


def reach(ros: RosSystem, node: Node, launched: Process, goal: tuple[float, float, float]) -> None:
    """Send a goal on the map to move_base, wait until it is reached, and end the launch."""
    results = Inbox()
    node.subscribe("/move_base/result", load_message_class("move_base_msgs/MoveBaseActionResult"), results)
    stamped: Any = load_message_class("geometry_msgs/PoseStamped")
    goals = node.advertise("/move_base_simple/goal", stamped, queue_size=1)
    wait_until(lambda: goals.connection_count, 90, lambda: str(launched.output))
    ros.wait_for_publisher("/move_base/result")

    goals.publish(plane.stamped_pose(goal, "map", Time(0, 0)))

    wait_until(lambda: results.messages, 120, lambda: str(launched.output))
    status = results.messages[0].status
    assert (status.status, status.text) == (3, "Goal reached."), launched.output
    launched.press_ctrl_c()
    assert launched.wait() == 0


@pytest.mark.parametrize("name", GOALS)
def test_the_robot_of_a_wrapper_reaches_a_goal(ros: RosSystem, name: str) -> None:
    goal, members = GOALS[name]
    launched = wrapped(ros, name, f"lockstep:={members}")
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        truth = Inbox()
        node.subscribe("/base_pose_ground_truth", load_message_class("nav_msgs/Odometry"), truth)
        reach(ros, node, launched, goal)
        place = truth.messages[-1].pose.pose.position
        assert (place.x, place.y) == pytest.approx(goal[:2], abs=0.5)
    assert "Traceback" not in launched.output


@pytest.mark.parametrize(("name", "scan", "frame", "reader"), [
    ("in_a_group", "/robot1/laser/scan", "robot1/base_scan", "/robot1/amcl"),
    ("slam", "/base_scan", "base_scan", "/slam_gmapping"),
])  # fmt: skip
def test_the_nodes_of_a_wrapper_get_their_scans(
    ros: RosSystem, name: str, scan: str, frame: str, reader: str
) -> None:
    launched = wrapped(ros, name)
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


# A simulated robot with amcl and move_base in lockstep: `navigation_world`, and drives in the apartment.


APARTMENT = str(SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml")
START = (2.9, 1.0, 1.2)
KITCHEN, BEDROOM, STUDY = (7.8, 1.5, 0.0), (2.5, 5.8, 1.5), (7.4, 5.9, -0.8)


@contextmanager
def world(ros: RosSystem, **options: Any) -> Iterator[NavigationWorld]:
    log = logging.getLogger("navigation_world")
    log.setLevel(logging.ERROR)
    try:
        with closing(NavigationWorld(ros.master_uri, APARTMENT, start=START, **options)) as made:
            yield made
    finally:
        log.setLevel(logging.NOTSET)  # of other tests of this process, too


@pytest.mark.parametrize("seed", range(10))
def test_every_seed_reaches_its_goal_without_touching_a_wall(ros: RosSystem, seed: int) -> None:
    ros.serve_master()
    with world(ros, seed=seed) as apartment, apartment.never_closer_than(0.01):
        apartment.reaches(*(KITCHEN, BEDROOM, STUDY)[seed % 3], within_s=90)
    errors_m, errors_rad = np.array(apartment.errors).T
    assert np.percentile(errors_m, 95) < 0.1
    assert np.percentile(errors_rad, 95) < np.radians(3)


def test_the_same_seed_gives_the_same_drive_twice(ros: RosSystem) -> None:
    ros.serve_master()
    ends = []
    for _ in range(2):
        with world(ros, seed=11) as apartment:
            apartment.send_goal(*BEDROOM)
            apartment.run_for(6.0)
            ends.append((apartment.pose, apartment.estimate, apartment.errors))
    assert ends[0] == ends[1]
    assert ends[0][0] != START


def test_failures_say_what_happened(ros: RosSystem) -> None:
    ros.serve_master()
    patience = {"move_base": {"planner_patience": 0.5, "recovery_behavior_enabled": False}}
    with world(ros, parameters=patience) as apartment:
        with pytest.raises(WorldFailure, match=r"aborted after .* s: Failed to find a valid plan"):
            apartment.reaches(4.05, 0.6, 0.0, within_s=30)  # in a wall
        with pytest.raises(WorldFailure, match=r"was not reached within 1 s: the robot is at \(\d\.\d+,"):
            apartment.reaches(*KITCHEN, within_s=1)
        came_near = pytest.raises(WorldFailure, match=r"obstacles must be at least 9 m, got 0\.\d+ m")
        with came_near, apartment.never_closer_than(9.0):
            apartment.run_for(0.5)
        with pytest.raises(WorldFailure, match=r"the localisation is wrong by \d\.\d+ m, 1 s after"):
            apartment.recovers_from_kidnapping(*KITCHEN, within_s=1)


def test_the_tests_of_the_example_package_pass_in_a_project_of_their_own() -> None:
    folder = REPOSITORY / "examples" / "navigation_tests"
    command = [sys.executable, "-m", "pytest", "-q", "-c", "/dev/null", "--rootdir", str(folder), str(folder)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert "3 passed" in ended.stdout, ended.stdout


# Launch files of the shape of turtlebot3_navigation and turtlebot3_slam, with pipros_sim as the robot.


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
    reach(ros, node, launched, (3.2, 2.0, 1.5))


@pytest.mark.usefixtures("node")
def test_turtlebot3_slam_publishes_a_map_that_map_saver_saves(ros: RosSystem) -> None:
    start_robot(ros, "[]")
    launched = ros.pipros.start("roslaunch", "turtlebot3_slam", "turtlebot3_slam.launch", "open_rviz:=false")
    ros.wait_for_publisher("/map")
    saved = ros.pipros.run("rosrun", "map_server", "map_saver", "-f", str(ros.home / "map"), timeout_s=120)
    assert saved.returncode == 0, (saved.output, launched.output)
    assert "resolution: 0.05" in (ros.home / "map.yaml").read_text()
