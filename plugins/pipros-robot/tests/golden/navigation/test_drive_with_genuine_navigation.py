"""Commands of genuine move_base and amcl, which drove a robot of pipros_sim to a goal, drive one again.

The commands are played open loop: what they command would depend on what the simulator does now.
"""

import math
from typing import Any
from xmlrpc.client import ServerProxy

import numpy as np

from pipros_libraries.maps.map_file import read_map
from pipros_robot.navigation.world_parameters import PARAMETERS, merged
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.settings import RobotSettings
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.world import World
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.recordings import Recording
from tests.support.ros import RosSystem

APARTMENT = SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml"
START, GOAL = (2.9, 1.0, 1.2), (2.3, 3.9, 1.6)
SUCCEEDED = 3


def test_genuine_move_base_and_amcl_drive_a_simulated_robot_to_a_goal(
    ros: RosSystem, recording: Recording
) -> None:
    recording.give("start and goal", [START, GOAL])
    initial = {f"initial_pose_{axis}": value for axis, value in zip("xya", START, strict=True)}
    as_recorded = {"DWAPlannerROS": {"min_vel_x": 0.0}}  # the robot drives backwards since
    parameters = merged(PARAMETERS, {"amcl": initial, "move_base": as_recorded})
    for name in ("amcl", "move_base"):
        recording.give(f"parameters {name}", parameters[name])
    world = World.from_grid(read_map(str(APARTMENT)))
    for run in range(len(recording.runs)):
        commands, truth, scans, scan_times = (
            recording.value(name, run) for name in ("commands", "truth", "scans", "scan times")
        )
        assert recording.value("result", run) == [SUCCEEDED, "Goal reached."]
        played, seen = _play(world, commands, truth, scan_times)
        errors = np.abs(played - truth[:, 1:])
        assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.3, run
        assert errors[:, 2].max() < 0.3, run
        assert math.dist(played[-1, :2], GOAL[:2]) < 0.4, run
        # The first scan is from the same pose: only its noise differs.
        apart_m = [np.median(np.abs(ours - scan)) for ours, scan in zip(seen, scans, strict=True)]
        assert apart_m[0] < 0.02, (run, apart_m)
        assert max(apart_m) < 0.35, (run, apart_m)
    _compare_topics(ros, recording)


def _compare_topics(ros: RosSystem, recording: Recording) -> None:
    """Compare the types of the simulator's topics with those of the nodes that drove its robot."""
    ros.serve_master()
    ros.pipros.start("rosrun", "pipros_sim", "sim", "_headless:=true", f"_map:={APARTMENT}")
    for topic in ("/scan", "/odom", "/tf"):
        ros.wait_for_publisher(topic)
    ros.wait_for_subscriber("/cmd_vel")
    with ServerProxy(ros.master_uri) as opened:
        master: Any = opened
        types = dict(master.getTopicTypes("/a_test")[2])
    nodes = recording.value("interfaces")
    given = nodes["/move_base"]["subscriptions"] | nodes["/amcl"]["subscriptions"]
    for topic in ("/scan", "/odom", "/tf"):
        assert types[topic] == given[topic]
    assert types["/cmd_vel"] == nodes["/move_base"]["publications"]["/cmd_vel"]


def _play(world: World, commands: Any, truth: Any, scan_times: Any) -> tuple[Any, list[Any]]:
    """Return the poses at the times of `truth`, and the scans, of a robot that is given the commands."""
    settings = RobotSettings(start=Pose(*truth[0, 1:]))
    simulation = Simulation(world, [settings], seed=1)
    robot, begin_s = simulation.robots[""], truth[0, 0]
    poses, scans, pending = [], [], list(commands)
    moments = sorted([(t, False) for t in truth[:, 0]] + [(t, True) for t in scan_times])
    for at_s, is_scan in moments:
        while simulation.time_s < at_s - begin_s - 1e-9:
            while pending and pending[0][0] - begin_s <= simulation.time_s:
                robot.command(*pending.pop(0)[1:], simulation.time_s)
            simulation.step()
        if is_scan:
            scans.append(np.array(simulation.scans([""])[""]))
        else:
            poses.append((robot.pose.x, robot.pose.y, robot.pose.yaw))
    return np.array(poses), scans
