"""Benchmarks run, and print pipros and genuine ROS beside each other."""

from __future__ import annotations

import re

from tests.support.environments import REPOSITORY, VENV_BIN
from tests.support.processes import Processes


def test_start_up_times_are_printed_side_by_side(processes: Processes) -> None:
    benchmark = REPOSITORY / "benchmarks" / "startup.py"

    ended = processes.run(VENV_BIN / "python", benchmark, "--rounds", "1", "--only", "rostopic,import")

    assert ended.returncode == 0, ended.output
    assert re.search(r"pipros +genuine +ratio$", ended.stdout[0])
    for what in ("rostopic list", "rosnode list", "import rospy"):
        assert re.search(rf"(?m)^{what} +\d+\.\d+ +\d+\.\d+ +\d+\.\d+x$", ended.output), ended.output


def test_the_libraries_are_measured_side_by_side(processes: Processes) -> None:
    benchmark = REPOSITORY / "benchmarks" / "libraries.py"

    ended = processes.run(VENV_BIN / "python", benchmark, "--rounds", "1", "--seconds", "0.2", timeout_s=120)

    assert ended.returncode == 0, ended.output
    for what in ("set_transform", "listener, ", "exact, ", "send_goal_and_wait, two", "import tf2_ros"):
        assert re.search(rf"(?m)^\| {what}.*( \| [\d.e+]+){{2}} \| \d+\.\d+ x \|$", ended.output), (
            ended.output
        )
