"""Genuine amcl and move_base drive a robot of pipros_sim to a goal, in real time."""

from __future__ import annotations

import math
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.navigation import plane
from pipros.navigation.wiring import advertise, subscribe
from pipros.navigation.world_parameters import PARAMETERS, merged
from pipros.node import Node
from pipros.node.clock import stamp
from pipros.workspace.index import SHARED_PACKAGES
from tests.support.navigation_oracle import add_to
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

APARTMENT = SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml"
START, GOAL = (2.9, 1.0, 1.2), (2.3, 3.9, 1.6)
SUCCEEDED = 3


@pytest.mark.timeout(300)
def test_genuine_move_base_and_amcl_drive_a_simulated_robot_to_a_goal(plain_ros: RosSystem) -> None:
    ros = plain_ros
    ros.serve_master()
    libraries = add_to(ros.genuine) / "lib"
    initial = {f"initial_pose_{axis}": value for axis, value in zip("xya", START, strict=True)}
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        for name, values in merged(PARAMETERS, {"amcl": initial}).items():
            node.params.set(f"/{name}", values)
        node.params.set("/sim/robots", [dict(zip(("x", "y", "yaw"), START, strict=True))])
        ros.pipros.start("rosrun", "pipros_sim", "sim", "_headless:=true", f"_map:={APARTMENT}")
        ros.genuine.start(libraries / "map_server" / "map_server", APARTMENT, "__name:=map_server")
        driver = ros.genuine.start(libraries / "move_base" / "move_base", "__name:=move_base")
        ros.genuine.start(libraries / "amcl" / "amcl")
        results, truths, estimates, statuses = Inbox(), Inbox(), Inbox(), Inbox()
        subscribe(node, "/move_base/result", "move_base_msgs/MoveBaseActionResult", results)
        subscribe(node, "/base_pose_ground_truth", "nav_msgs/Odometry", truths)
        subscribe(node, "/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped", estimates)
        subscribe(node, "/move_base/status", "actionlib_msgs/GoalStatusArray", statuses)
        goals: Any = advertise(node, "/move_base_simple/goal", "geometry_msgs/PoseStamped")
        wait_until(lambda: goals.connection_count and estimates.messages, 60, lambda: driver.output)
        wait_until(lambda: statuses.messages, 60, "the action server, without which a goal is lost")

        goals.publish(plane.stamped_pose(GOAL, "map", stamp(node.clock)))

        wait_until(lambda: results.messages, 120, lambda: driver.output)
        status = results.messages[0].status
        assert (status.status, status.text) == (SUCCEEDED, "Goal reached.")
        truth, estimate = (plane.flat_message(each.messages[-1].pose.pose) for each in (truths, estimates))
        assert math.dist(truth[:2], GOAL[:2]) < 0.3
        assert abs(math.remainder(truth[2] - GOAL[2], math.tau)) < 0.4
        assert math.dist(truth[:2], estimate[:2]) < 0.4
        assert math.dist(truth[:2], START[:2]) > 2.0
