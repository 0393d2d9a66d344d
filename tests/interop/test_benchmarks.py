"""The benchmark of start-up times runs, and prints pipros and genuine ROS beside each other."""

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
