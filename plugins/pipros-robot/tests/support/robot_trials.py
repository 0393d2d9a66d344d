"""Drives of launch sets to five goals each: `python -m tests.support.robot_trials [--only NAME,…]`.

Each set is started with `roslaunch`. The table contains the greatest error of the true pose at the goals, and
what the simulator measured: the greatest speeds beside the limits in the set's parameters, and the bumps.
"""

import argparse
import math
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_robot.navigation import plane
from pipros_robot.navigation.plane import Triple
from pipros_simulation.robots.drive import Pose, relative
from pipros_tools.launch.roscore import Core
from tests.support.environments import make_tool_folder, pipros_environment
from tests.support.processes import Process, Processes
from tests.support.robot_sets import GOALS, SETS, START, RobotSet, launch_file

WITHIN_S: Final = 120.0
"""Simulated time per goal."""
START_S: Final = 90.0
"""Real time for the start of all nodes, and without a step of the simulator."""
_PREEMPTED, _SUCCEEDED = 2, 3
SLACK_M: Final = 0.15
"""Error of the localisation that a goal may have in addition to its tolerance."""


class Trial:
    """One set that runs. Callbacks run in other threads."""

    def __init__(self, node: Node, each: RobotSet) -> None:
        self._node, self._set = node, each
        self.speed = self.turn = self.time_s = 0.0
        self.bumps = 0
        self.errors: list[tuple[float, float]] = []
        self.problems: list[str] = []
        self._pose: Triple = START
        self._results: list[Any] = []
        self._seen_s = time.monotonic()
        for topic, kind, take in (
            ("/base_pose_ground_truth", "nav_msgs/Odometry", self._on_truth),
            ("/bumper", "std_msgs/Bool", self._on_bumper),
            ("/move_base/result", "move_base_msgs/MoveBaseActionResult", self._on_result),
        ):
            node.subscribe(topic, load_message_class(kind), take)
        pose: Any = load_message_class("geometry_msgs/PoseStamped")
        self._goals = node.advertise("/move_base_simple/goal", pose, queue_size=1)

    def _on_truth(self, message: Any) -> None:
        self._pose = plane.flat_message(message.pose.pose)
        self.time_s = message.header.stamp.to_sec()
        self._seen_s = time.monotonic()
        linear = message.twist.twist.linear
        self.speed = max(self.speed, math.hypot(linear.x, linear.y))
        self.turn = max(self.turn, abs(message.twist.twist.angular.z))

    def _on_bumper(self, message: Any) -> None:
        self.bumps += message.data

    def _on_result(self, message: Any) -> None:
        if message.status.status != _PREEMPTED:  # of a goal that was not reached in time
            self._results.append(message.status)

    def wait_for_start(self, launched: Process) -> bool:
        """Wait until move_base takes goals and its result has a link. Return whether it does."""
        end_s = time.monotonic() + START_S
        while not (self._goals.connection_count and self.time_s > 4.5):
            if time.monotonic() > end_s or not launched.is_running:
                return False
            time.sleep(0.1)
        return True

    def drive(self, goal: Triple) -> None:
        """Drive to a goal on the map of the apartment, and note the error or the problem."""
        frame = "odom" if self._set.localisation == "ekf" else "map"
        there = Pose(*goal) if self._set.has_map else relative(Pose(*START), Pose(*goal))
        self._results.clear()
        began_s = self.time_s
        self._goals.publish(plane.stamped_pose((there.x, there.y, there.yaw), frame, Time(0, 0)))
        while not self._results:
            if self.time_s > began_s + WITHIN_S or time.monotonic() > self._seen_s + START_S:
                self._note(goal, "not reached in time")
                return
            time.sleep(0.02)
        if self._results[0].status != _SUCCEEDED:
            self._note(goal, self._results[0].text)
            return
        x, y, yaw = self._pose
        self.errors.append((math.dist((x, y), goal[:2]), abs(math.remainder(yaw - goal[2], math.tau))))
        if self.errors[-1][0] > self._set.parameters["xy_goal_tolerance"] + SLACK_M:
            self._note(goal, "too far away")

    def _note(self, goal: Triple, problem: str) -> None:
        self.problems.append(
            f"{goal}: {problem}; the robot is at ({', '.join(f'{a:.2f}' for a in self._pose)})"
        )

    def row(self) -> str:
        """Return the row of the table."""
        each = self._set
        away, turned = map(max, zip(*self.errors or [(math.nan, math.nan)], strict=True))
        shape = (each.simulator, each.global_planner.rpartition("/")[2], each.localisation)
        cells = (
            each.name, re.split("[/:]", each.planner)[-1],
            ", ".join((*shape, each.costmaps, each.laser, each.commands)),
            f"{len(self.errors)} of {len(GOALS)}", f"{away:.2f} m, {turned:.2f} rad",
            f"{self.speed:.3f} of {each.speed:g} m/s", f"{self.turn:.3f} of {each.turn:g} rad/s",
            str(self.bumps), f"{self.time_s:.0f} s",
        )  # fmt: skip
        return f"| {' | '.join(cells)} |"


@contextmanager
def launched(each: RobotSet, seed: int) -> Iterator[tuple[Trial, Process]]:
    """Start a set with a master, and a node that observes it."""
    with (
        tempfile.TemporaryDirectory() as name,
        Core(port=0, rosout=False, environment=Environment.from_os()) as core,
    ):
        folder = Path(name)
        processes = Processes(pipros_environment(folder, core.uri, make_tool_folder(folder / "bin")), folder)
        try:
            with Node("trial", environment=Environment(master_uri=core.uri)) as node:
                process = processes.start("roslaunch", launch_file(each, folder, seed))
                yield Trial(node, each), process
                process.press_ctrl_c()
                process.wait()
        finally:
            processes.end_all()


def run(each: RobotSet, seed: int, *, verbose: bool) -> bool:
    """Drive one set, print its row and its problems, and return whether there were none."""
    with launched(each, seed) as (trial, process):
        if trial.wait_for_start(process):
            for goal in GOALS:
                trial.drive(goal)
        else:
            trial.problems.append("move_base did not start")
    output = process.output
    trial.problems += [line for line in output.splitlines() if "has died" in line or "Traceback" in line]
    if trial.speed > each.speed + 1e-6 or trial.turn > each.turn + 1e-6:
        trial.problems.append("a limit was exceeded")
    print(trial.row(), *(f"    {problem}" for problem in trial.problems), sep="\n", flush=True)
    if verbose:
        print(output)
    return not trial.problems and not trial.bumps


def main() -> int:
    """Run the sets, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", help="names of sets, separated by commas")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--verbose", action="store_true", help="print the output of roslaunch")
    given = parser.parse_args()
    chosen = [each for each in SETS if given.only is None or each.name in given.only.split(",")]
    print(
        "| set | planner | arrangement | reached | true pose | fastest | fastest turn | bumps | simulated |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | ---: | ---: |")
    good = sum([run(each, given.seed, verbose=given.verbose) for each in chosen])
    print(f"{good} of {len(chosen)} sets without a problem")
    return 0 if good == len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main())
