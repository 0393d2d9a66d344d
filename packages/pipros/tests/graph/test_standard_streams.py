"""Commands and nodes whose standard output is closed, full, or has a limited encoding."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.support.processes import Process
from tests.support.ros import RosSystem

COMMANDS = [
    "rosnode list",
    "rosnode info /rosout",
    "rostopic list",
    "rosservice list",
    "rosparam get /run_id",
    "rospack list",
    "rosmsg list",
    "rosversion -d",
    "rostopic --help",
]

NODE = """
import sys, rospy
from std_msgs.msg import String
rospy.init_node("speaker")
publisher = rospy.Publisher("/said", String, latch=True, queue_size=1)
for number in range(3):
    rospy.loginfo("line %d", number)
    print("printed", number, flush=sys.argv[1] == "flush")
publisher.publish("still here")
rospy.spin()
"""

LOGGING_NODE = """
import rospy
rospy.init_node("n")
rospy.loginfo("one")
rospy.logwarn("caf\\xe9")
rospy.loginfo("two")
"""


def shell(ros: RosSystem, script: str, **variables: str) -> Process:
    return ros.pipros.run("bash", "-c", script, **variables)


@pytest.mark.parametrize("command", ["rosmsg list", "rosmsg show -r sensor_msgs/PointCloud2", "rospack list"])
@pytest.mark.parametrize("is_buffered", ["", "1"])
def test_a_command_ends_quietly_when_its_reader_closes_the_pipe(
    ros: RosSystem, command: str, is_buffered: str
) -> None:
    script = f"{command} 2>errors | head -n 1 >/dev/null; echo ${{PIPESTATUS[0]}}; cat errors"
    assert shell(ros, script, PYTHONUNBUFFERED=is_buffered).stdout == ["0"]


@pytest.mark.parametrize("program", ["tf tf_echo a b 50", "tf tf_monitor"])
def test_a_program_of_a_package_ends_quietly_when_its_reader_closes_the_pipe(
    ros: RosSystem, program: str
) -> None:
    ros.pipros.start_master()
    script = f"rosrun {program} 2>errors | head -n 1 >/dev/null; echo ${{PIPESTATUS[0]}}; cat errors"
    assert shell(ros, script).stdout == ["0"]


@pytest.mark.timeout(300)
@pytest.mark.parametrize("is_buffered", ["", "1"])
def test_a_command_without_a_standard_output_succeeds_silently(ros: RosSystem, is_buffered: str) -> None:
    ros.pipros.start_master()
    for command in COMMANDS:
        closed = shell(ros, f"{command} >&-", PYTHONUNBUFFERED=is_buffered)
        usual = shell(ros, f"{command} >/dev/null", PYTHONUNBUFFERED=is_buffered)
        assert (closed.returncode, closed.lines) == (usual.returncode, []), command


@pytest.mark.timeout(300)
@pytest.mark.parametrize("is_buffered", ["", "1"])
def test_output_that_cannot_be_written_is_one_line_and_pythons_code(ros: RosSystem, is_buffered: str) -> None:
    ros.pipros.start_master()
    for command in COMMANDS:
        ended = shell(ros, f"{command} >/dev/full", PYTHONUNBUFFERED=is_buffered)
        lines = ["ERROR: cannot write to standard output: No space left on device"]
        assert (ended.returncode, ended.lines) == (120, lines), command


def test_rostopic_echo_ends_when_its_messages_cannot_be_written(ros: RosSystem) -> None:
    ros.pipros.start_master()
    ros.pipros.start("rostopic", "pub", "/said", "std_msgs/String", "x")
    ended = shell(ros, "rostopic echo /said >/dev/full")
    assert ended.returncode == 120
    assert ended.lines[-1] == "ERROR: cannot write to standard output: No space left on device"


def test_all_standard_streams_may_be_closed(ros: RosSystem) -> None:
    ros.pipros.start_master()
    assert shell(ros, "rosnode list <&- >&- 2>&-").returncode == 0
    assert shell(ros, "rosnode info /nobody <&- >&- 2>&-").returncode == 0
    ended = shell(ros, "rosparam set /x 1 <&- >&-; rosparam get /x")
    assert ended.stdout == ["1"]


@pytest.mark.parametrize(("to", "how"), [(">&-", "flush"), (">&-", "keep"), (">/dev/full", "keep")])
def test_a_node_continues_without_a_standard_output(
    ros: RosSystem, tmp_path: Path, to: str, how: str
) -> None:
    ros.pipros.start_master()
    (tmp_path / "speaker.py").write_text(NODE)
    node = ros.pipros.start("bash", "-c", f"exec {sys.executable} speaker.py {how} {to}", PYTHONUNBUFFERED="")
    heard = ros.pipros.run("rostopic", "echo", "-n1", "/said")
    assert heard.stdout[0] == 'data: "still here"'
    assert node.is_running
    node.press_ctrl_c()
    node.wait()


def test_roslaunch_runs_its_nodes_when_its_output_is_lost(ros: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "param.launch").write_text('<launch><param name="done" value="1"/></launch>')
    ros.pipros.start_master()
    for to in (">&-", ">/dev/full"):
        ended = shell(
            ros, f"rosparam delete /done 2>/dev/null; roslaunch param.launch {to}; rosparam get /done"
        )
        assert "1" in ended.stdout, ended.output
        assert "Traceback" not in ended.output


def test_characters_that_the_encoding_does_not_have_are_escaped(ros: RosSystem, tmp_path: Path) -> None:
    ros.pipros.start_master()
    ros.pipros.run("rosparam", "set", "/street", "Straße")
    ended = ros.pipros.run("rosparam", "get", "-p", "/street", PYTHONIOENCODING="ascii")
    assert (ended.returncode, ended.stdout) == (0, ["Stra\\xdfe"])
    ended = ros.pipros.run(sys.executable, "-c", LOGGING_NODE, PYTHONIOENCODING="ascii")
    assert [line.partition("]: ")[2] for line in ended.stdout] == ["one", "two"]
    assert "caf\\xe9" in ended.stderr[0]
    (tmp_path / "é.launch").write_text('<launch><param name="é" value="ü"/></launch>')
    ended = ros.pipros.run("roslaunch", "--dump-params", "é.launch", PYTHONIOENCODING="ascii")
    assert "Traceback" not in ended.output
