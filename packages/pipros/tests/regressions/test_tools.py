"""Reported faults of rosbag, roslaunch, rosparam and rosnode on the command line."""

import signal
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String

import roslaunch
import roslaunch.config
from pipros.msg import load_service_class
from pipros_tools.bag.reader import BagReader
from pipros_tools.cli.rosservice import main
from pipros_tools.graph.node_info import describe_registrations
from tests.support.nodes import MakeNode
from tests.support.ros import RosSystem

# ros_comm#2263: `rosnode kill -a` in a launch file took `__name:=` and `__log:=` for names of nodes.
# roslaunch appends these arguments, after the remappings, to the arguments of each `<node>`.


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


@pytest.mark.parametrize("command", [
    "rosnode list", "rosnode info /nobody", "rosparam list", "rosparam set pair 1", "rosparam get pair",
    "rosservice list", "rostopic list", "rosmsg md5 std_msgs/String", "rosclean check", "roslaunch {file}",
    "roslaunch-check {file}", "roslaunch-complete rostest", "roslaunch-deps {file}",
])  # fmt: skip
def test_tools_ignore_the_arguments_that_roslaunch_appends(ros: RosSystem, command: str) -> None:
    ros.serve_master()
    file = ros.home / "empty.launch"
    file.write_text('<launch><arg name="scan" default="scan"/></launch>')
    words = command.format(file=file).split()
    expected, got = ros.pipros.run(*words), ros.pipros.run(*words, *APPENDED)
    assert (got.returncode, got.stderr) == (expected.returncode, expected.stderr)
    assert got.stdout[-3:] == expected.stdout[-3:]


# ros_comm#2236: rosbag failed at its end if the shell that started it had set SIGINT to be ignored. Shells
# do so for jobs in the background of a script. Python then has a number instead of a handler.


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_recording_in_the_background_ends_without_an_error(ros: RosSystem, number: int) -> None:
    ros.serve_master()
    talker = ros.pipros.start_node("rospy_tutorials", "talker.py")
    recording = ros.pipros.start(
        "sh", "-c", "trap '' INT; exec rosbag record -O recorded.bag --duration 600 /chatter"
    )
    ros.wait_for_subscriber("/chatter")
    ros.wait_for_links("/chatter")
    recording.send_signal(number)
    recording.check(0)
    with BagReader(ros.home / "recorded.bag") as bag:
        assert bag.layout is not None
    talker.press_ctrl_c()


# ros_comm#2371, #2217: reading a launch file without its arguments raised an unexpected error.


UNSET = '<arg name="a"/><arg name="b" default="$(arg a)"/><node pkg="rospy" type="x" name="n$(arg b)"/>'


@pytest.mark.parametrize("content", [UNSET, '<arg name="b" value="$(arg a)"/>'])
def test_an_argument_without_a_value_is_an_error_that_programs_catch(tmp_path: Path, content: str) -> None:
    file = tmp_path / "x.launch"
    file.write_text(f"<launch>{content}</launch>")
    with pytest.raises(roslaunch.RLException, match="requires the 'a' arg to be set"):
        roslaunch.config.load_config_default([str(file)], None)


def test_the_nodes_of_a_file_are_listed_without_its_arguments(tmp_path: Path) -> None:
    file = tmp_path / "x.launch"
    file.write_text(f"<launch>{UNSET}<node pkg='rospy' type='x' name='m'/></launch>")
    config = roslaunch.config.load_config_default([str(file)], None, ignore_unset_args=True)
    assert [node.name for node in config.nodes] == ["n", "m"]


# roslaunch: a file that includes itself had no end, and files of other encodings could not be read.


LAUNCH = '<launch><param name="name" value="küche"/></launch>'


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1"])
def test_a_launch_file_may_have_any_declared_encoding(encoding: str, ros: RosSystem, tmp_path: Path) -> None:
    file = tmp_path / "a.launch"
    declared = encoding.removesuffix("-sig").upper()
    file.write_bytes(f'<?xml version="1.0" encoding="{declared}"?>\n{LAUNCH}'.encode(encoding))
    found = ros.pipros.run("roslaunch", "--dump-params", str(file))
    assert found.output.strip() == "/name: küche"


def test_files_that_include_each_other_are_an_error(ros: RosSystem, tmp_path: Path) -> None:
    for name, other in ("ab", "ba"):
        include = f'<launch><include file="$(dirname)/{other}.launch"/></launch>'
        (tmp_path / f"{name}.launch").write_text(include)
    found = ros.pipros.run("roslaunch", "--nodes", str(tmp_path / "a.launch"))
    found.check(1, "is there a cycle?")


# ROS Answers: with LANG=C, as in cron, roslaunch failed for files with letters other than ASCII.


LOCALE_LAUNCH = """<?xml version="1.0" encoding="UTF-8"?>
<launch>
  <!-- Größe in µm -->
  <arg name="name" default="Zoë"/>
  <param name="robot" value="$(arg name) €"/>
  <param name="from_command" command="PYTHON -c 'print(&quot;Straße&quot;)'"/>
  <param name="from_file" textfile="$(dirname)/text.txt"/>
  <rosparam file="$(dirname)/values.yaml"/>
</launch>
"""
VALUES = {"robot": "Zoë €", "from_command": "Straße\n", "from_file": "Übung", "von_yaml": "Señal"}


@pytest.mark.parametrize("locale", ["C", "POSIX"])
def test_files_with_other_letters_are_read_in_the_c_locale(ros: RosSystem, locale: str) -> None:
    (ros.home / "x.launch").write_text(LOCALE_LAUNCH.replace("PYTHON", sys.executable), "utf-8")
    (ros.home / "text.txt").write_text("Übung", "utf-8")
    (ros.home / "values.yaml").write_text("von_yaml: Señal  # größer\n", "utf-8")
    ros.serve_master()
    launch = ros.pipros.run("roslaunch", "x.launch", LC_ALL=locale, LANG=locale)
    assert launch.returncode == 0, launch.output
    with ros.node("reader") as node:
        assert {name: node.params.get(f"/{name}") for name in VALUES} == VALUES


# rosparam: a file with one number beyond 32 bits, or an empty value, was loaded up to this line.


@pytest.mark.parametrize("bad", ["99999999999", "[1, [2, null]]"])
def test_a_file_with_a_value_that_cannot_be_sent_changes_nothing(bad, ros, tmp_path, master) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(f"first: 1\nwheels: {{left: 2}}\nbad: {bad}\nlast: 3\n")
    loaded = ros.pipros.run("rosparam", "load", str(file), "/robot", ROS_MASTER_URI=master.uri)
    loaded.check(1, "cannot set parameter [/robot/bad] to", "a parameter must consist of booleans, integers")
    assert ros.pipros.run("rosparam", "list", ROS_MASTER_URI=master.uri).output.strip() == ""


# ros_comm#2366: `rosnode info` printed `[unknown type]` for a topic that has no publisher.


def test_the_type_of_a_topic_with_only_subscribers_is_described(make_node: MakeNode) -> None:
    node = make_node("listener")
    node.subscribe("/heard", String, print)
    node.master.register_subscriber("/untyped", "*", node.uri)
    described = describe_registrations(node.master, "/listener")
    assert " * /heard [std_msgs/String]\n" in described
    assert " * /untyped [unknown type]\n" in described


# ros_comm#2369: `rosservice call` with `now` or `auto` failed, because its time was not initialized.


@pytest.mark.parametrize("header", ["auto", "{stamp: now, frame_id: map}"])
def test_a_request_can_have_the_time(make_node: MakeNode, monkeypatch, header: str) -> None:
    get_plan: Any = load_service_class("nav_msgs/GetPlan")
    node, stamps = make_node("planner"), []
    monkeypatch.setenv("ROS_MASTER_URI", node.master.uri)

    def plan(request: Any) -> Any:
        stamps.append(request.start.header.stamp.to_sec())
        return get_plan._response_class()

    node.serve("/plan", get_plan, plan)
    before = time.time()
    assert main(["call", "/plan", f"{{start: {{header: {header}}}}}"]) == 0
    assert before - 1 <= stamps[0] <= time.time() + 1
