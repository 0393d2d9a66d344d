"""A container that is started with only a user number: no HOME, no account."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.support.ros import RosSystem
from tests.support.users import NOBODY, STRANGER, needs_nobody
from tests.support.waiting import wait_until

pytestmark = needs_nobody

_NODE = """\
import rospy
rospy.init_node("homeless")
print("named", rospy.get_name(), flush=True)
rospy.spin()
"""


@pytest.fixture
def homeless(ros: RosSystem) -> Path:
    """Return the folder that replaces the home of the programs of `ros`."""
    temporary = ros.home / "tmp"
    temporary.mkdir()
    for name in ("HOME", "ROS_HOME"):
        del ros.pipros.environment[name]
    ros.pipros.environment["TMPDIR"] = str(temporary)
    return temporary / f"pipros-home-{STRANGER}"


def test_a_system_runs_and_can_be_queried_as_usual(ros: RosSystem, homeless: Path) -> None:
    core = ros.pipros.start(*NOBODY, "roscore", "-p", str(ros.port))
    core.wait_for(r"started core service \[/rosout\]")
    (ros.home / "node.py").write_text(_NODE)
    node = ros.pipros.start(*NOBODY, "python", ros.home / "node.py")
    node.wait_for("named /homeless")
    launch = ros.home / "x.launch"
    launch.write_text("<launch><param name='a' value='7'/></launch>")

    for command, expected in {
        "rosnode list": "/homeless",
        "rostopic list": "/rosout",
        "rospack find std_msgs": "std_msgs",
        "rosmsg show std_msgs/String": "string data",
        f"roslaunch {launch}": "No processes to monitor",
        "rosparam get /a": "7",
        "roslaunch-logs": f"{homeless}/.ros/log/",
    }.items():
        ran = ros.pipros.run(*NOBODY, *command.split())
        assert ran.returncode == 0, ran.output
        assert expected in ran.output
        assert "Traceback" not in ran.output

    assert wait_until(lambda: (homeless / ".ros" / "log" / "homeless.log").is_file())
    assert os.listdir(ros.home / "tmp") == [homeless.name]
    assert not (ros.home / "~").exists()
