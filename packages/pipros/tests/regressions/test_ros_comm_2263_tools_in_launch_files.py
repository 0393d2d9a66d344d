"""ros_comm#2263: `rosnode kill -a` in a launch file took `__name:=` and `__log:=` for names of nodes.

roslaunch appends these arguments, after the remappings, to the arguments of each `<node>`.
"""

from __future__ import annotations

import pytest

from tests.support.ros import RosSystem

APPENDED = ("scan:=front/scan", "__name:=tool", "__log:=/tmp/tool.log")


def test_a_launch_file_can_end_all_nodes(ros: RosSystem) -> None:
    ros.serve_master()
    victim = ros.pipros.start_node("rospy_tutorials", "talker.py")
    ros.wait_for_publisher("/chatter")
    file = ros.home / "kill.launch"
    file.write_text(
        '<launch><node pkg="rosnode" type="rosnode" name="killer" args="kill -a" output="screen" '
        'required="true"><remap from="a" to="b"/></node></launch>'
    )
    launched = ros.pipros.run("roslaunch", file)
    assert "killed" in "\n".join(launched.stdout), launched.output
    assert victim.wait() == 0


@pytest.mark.parametrize(
    "command",
    [
        "rosnode list",
        "rosnode info /nobody",
        "rosparam list",
        "rosparam set pair 1",
        "rosparam get pair",
        "rosservice list",
        "rostopic list",
        "rosmsg md5 std_msgs/String",
        "rosclean check",
        "roslaunch {file}",
        "roslaunch-check {file}",
        "roslaunch-complete rostest",
        "roslaunch-deps {file}",
    ],
)
def test_tools_ignore_the_arguments_that_roslaunch_appends(ros: RosSystem, command: str) -> None:
    ros.serve_master()
    file = ros.home / "empty.launch"
    file.write_text('<launch><arg name="scan" default="scan"/></launch>')
    words = command.format(file=file).split()
    expected, got = ros.pipros.run(*words), ros.pipros.run(*words, *APPENDED)
    assert (got.returncode, got.stderr) == (expected.returncode, expected.stderr)
    assert got.stdout[-3:] == expected.stdout[-3:]
