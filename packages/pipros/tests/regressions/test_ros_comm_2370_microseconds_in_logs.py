"""ros_comm#2370: `%f` in the times of `ROSCONSOLE_FORMAT` was printed as it is."""

from __future__ import annotations

import re
import sys

import pytest

from pipros.master.master import Master
from tests.support.processes import Processes

SCRIPT = 'import rospy; rospy.init_node("node"); rospy.loginfo("x")'


@pytest.mark.parametrize("name", ["time", "walltime"])
def test_times_of_log_lines_can_have_microseconds(processes: Processes, master: Master, name: str) -> None:
    variables = {
        "ROS_MASTER_URI": master.uri,
        "ROSCONSOLE_FORMAT": f"[${{{name}:%H:%M:%S.%f %%f}}] ${{message}}",
    }
    node = processes.run(sys.executable, "-c", SCRIPT, environment=variables)
    (line,) = node.stdout
    assert re.fullmatch(r"\[\d\d:\d\d:\d\d\.\d{6} %f\] x", line)
