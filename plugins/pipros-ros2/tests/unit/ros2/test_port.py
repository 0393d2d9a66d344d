"""Drafts of rospy nodes for rclpy. `port_nodes.txt` contains 30 nodes in the style of public ones."""

import ast
import math
import os
import re
import runpy
import shutil
import socket
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import pytest

from pipros.safe.xml import parse
from pipros_ros2.bridged_topics import RateLimit
from pipros_ros2.commands.port import main
from pipros_ros2.port.draft import Draft, NotPortable, draft_of
from pipros_ros2.port.launches import LaunchDrafts
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange, multicast_port
from pipros_ros2.rtps.unseen import hint_for
from pipros_ros2.rules import GatewayRules
from pipros_ros2.serve import GatewayOptions
from pipros_ros2.type_pairs import TypePairs
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.installed import installed_definitions
from pipros_tools.launch.model import NODE_SETTINGS, NodeSetting
from tests.support.environments import PACKAGES, benchmark
from tests.support.ros2_domains import free_domain

NODES = {
    name: text
    for name, _, text in (
        part.partition("\n")
        for part in re.split(
            r"^=== ", Path(__file__).with_name("port_nodes.txt").read_text(), flags=re.MULTILINE
        )[1:]
    )
}
CASES = [
    ("p = rospy.Publisher('a', String, queue_size=5)", "p = node.create_publisher(String, 'a', 5)"),
    ("p = rospy.Publisher('~a', String)", "p = node.create_publisher(String, '~/a', 10)"),
    ("rospy.Subscriber('a', String, f, 1)", "(String, 'a', lambda message, args=1: (f)(message, args)"),
    ("rospy.loginfo('%s %s', 1, 2)", "node.get_logger().info('%s %s' % (1, 2))"),
    ("rospy.logwarn_throttle(2, 'x')", "node.get_logger().warning('x', throttle_duration_sec=2)"),
    ("rospy.logerr(1)", "node.get_logger().error(str(1))"),
    ("x = rospy.get_param('~a/b', 1)", "x = get_param('a.b', 1)"),
    ("t = Twist(); t.linear.x = 1", "t.linear.x = 1.0"),
    ("t = Twist(); t.linear.x = y", "t.linear.x = float(y)"),
    ("v = Vector3(1, 2, z)", "v = Vector3(x=1.0, y=2.0, z=float(z))"),
    ("i = Imu(); i.header.stamp = rospy.Time.now()", "i.header.stamp = node.get_clock().now().to_msg()"),
    ("i = Imu(); i.header.seq = 3", "pass"),
    ("i = Imu(); a = i.header.stamp.secs", "a = i.header.stamp.sec"),
    ("i = Imu(); a = i.header.stamp.to_sec()", "a = (Time.from_msg(i.header.stamp).nanoseconds / 1e9)"),
    ("i = Imu(); i.orientation_covariance = [0] * 9", "= [float(each) for each in [0] * 9]"),
    ("p = rospy.Publisher('a', String); p.publish('x')", "p.publish(String(data='x'))"),
    ("while not rospy.is_shutdown(): pass", "while rclpy.ok(): pass"),
    ("rospy.sleep(1)", "node.get_clock().sleep_for(Duration(seconds=1))"),
    ("def f(_): pass\nrospy.Timer(rospy.Duration(2), f)", "node.create_timer(2, lambda: (f)(None))"),
    ("rospy.Timer(rospy.Duration(r), lambda _: 1)", "(r, lambda call=(lambda _: 1): call(None))"),
    ("i = Imu(); a = (i.header.stamp) > rospy.Time(0)", "(Time.from_msg(i.header.stamp)) > Time("),
    ("i = Imu(); a = rospy.Time.now() - i.header.stamp", "now() - Time.from_msg(i.header.stamp)"),
    ("i = None\ni = Imu(); a = rospy.Time.now() - i.header.stamp", "now() - Time.from_msg(i.header.stamp)"),
    ("a = rospy.Time.now() - m.header.stamp", "now() - Time.from_msg(m.header.stamp)"),
    ("def f(): return Imu().header.stamp\na = f() < rospy.Time.now()", "Time.from_msg(f()) < node.get"),
    ("i = Imu(); i.header.stamp += rospy.Duration(1)", "stamp) + Duration(seconds=1)).to_msg()"),
    ("t = None\nt = rospy.Time.now()\nif t and t > rospy.Time(1): pass", "if t and t > Time(seconds=1,"),
    ("s = rospy.ServiceProxy('a', SetBool); s(True)", "s.call(SetBool.Request(data=True))"),
    ("x = f'é {rospy.get_time():{rospy.get_name()}}'", "/ 1e9):{node.get_fully_qualified_name()}}'"),
    ("c = CameraInfo(); c.K = [1] * 9", "c.k = [float(each) for each in [1] * 9]"),
    ("c = CameraInfo(D=[], K=k)", "CameraInfo(d=[], k=[float(each) for each in k])"),
    ("rospy.Subscriber('a', CameraInfo, lambda m: m); c = CameraInfo(); f(c.K[0])", "f(c.k[0])"),
    ("r = SetBoolResponse(True, 'x')", "r = SetBool.Response(success=True, message='x')"),
    # rclpy sends 5e-324 for a float64 that is 1, and False for a bool that is 1
    ("t = Twist(); v = t.linear; v.x = v.y = 1", "v.x = v.y = 1.0"),
    ("v = Vector3(); v.x, v.y, a = 1, k, 2", "v.x, v.y, a = 1.0, float(k), 2"),
    ("for v in [Vector3()]: v.x = 1", "v.x = 1.0"),
    ("def f(v): v.x = 1\nf(Vector3())", "v.x = 1.0"),
    ("p = PoseArray(); p.poses[0].position.x = 1", "position.x = 1.0"),
    ("p = PoseArray()\nfor i, each in enumerate(p.poses): each.position.x = i", "position.x = float(i)"),
    ("v = Vector3(a / b, 0, 0)", "v = Vector3(x=float(a / b), y=0.0, z=0.0)"),
    ("r = SetBoolResponse(1, 'x')", "success=bool(1)"),
    ("i = Image(); i.data = 'abc'", "i.data = 'abc'.encode()"),
    ("p = {n: rospy.Publisher(n, String) for n in 'ab'}; p['a'].publish('x')", "publish(String(data='x'))"),
    ("p = []; p.append(rospy.Publisher('a', String))\nfor q in p: q.publish('x')", "(String(data='x'))"),
    ("t = {}; t[1] = rospy.Time.now()\nfor k, s in t.items(): a = (s - s).to_sec()", "(s - s).nanos"),
    ("class A:\n  t = rospy.Duration(1)\n  def f(self): return rospy.Time.now() - self.t", "now() - self.t"),
    ("def f(n): pass\nrospy.Timer(rospy.Duration(1), lambda e, n=1: f(n))", "e, n=1: f(n)): call(None)"),
    ("d = rospy.Duration(1) if x else rospy.Duration(2); a = d.to_sec()", "a = (d.nanoseconds / 1e9)"),
    ("rospy.loginfo('%(a)s', {'a': 1})", "info('%(a)s' % {'a': 1})"),
    ("for n in 'ab': rospy.Subscriber(n, String, f, n)", "lambda message, args=n: (f)(message, args)"),
    ("for f in g: rospy.Service('a', SetBool, lambda r: SetBoolResponse(True, f))", "call=(lambda r:"),
    ("def f(r): return {'success': True}\nrospy.Service('a', SetBool, f)", "(success=True)"),
    ("rospy.Service('a', SetBool, lambda r: (1, 'x'))", "r: SetBool.Response(success=bool(1), message='x')"),
    ("x = rospy.get_param('~names', ['a', 'b'])", "get_param('names', ['a', 'b'])"),
]  # fmt: skip
HEAD = """import rospy
from std_msgs.msg import Byte, String
from geometry_msgs.msg import PoseArray, Twist, Vector3
from sensor_msgs.msg import CameraInfo, Image, Imu
from std_srvs.srv import SetBool, SetBoolResponse
rospy.init_node('n')
"""


def _draft(source: str) -> Draft:
    return draft_of(source, installed_definitions())


@pytest.mark.parametrize(("before", "after"), CASES)
def test_calls_and_values_are_written_for_rclpy(before: str, after: str) -> None:
    draft = _draft(f"{HEAD}{before}\n")

    assert after in draft.text
    assert "TODO" not in draft.text
    ast.parse(draft.text)


@pytest.mark.parametrize(("line", "reason"), [
    ("p = rospy.Publisher('a', String); p.publish(unknown())", "publish takes a message of std"),
    ("x = rospy.get_param('/rate', 1)", "[/rate] was on the parameter server"),
    ("x = rospy.get_param(name)", "the name of a parameter must be a text here"),
    ("rospy.Timer(rospy.Duration(1), f, oneshot=True)", "rospy.Timer: the argument oneshot has no"),
    ("i = Imu(); print(i.header.seq)", "std_msgs/Header has no seq in ROS 2"),
    ("rospy.get_published_topics()", "ROS 2 has no such function"),
    ("x = f'{rospy.get_param(\"~a\")}'", "this f-string with rospy inside is not changed"),
    ("SetBoolResponse(*values)", "the arguments of std_srvs/SetBool need names"),
    ("rospy.Publisher('a', Unknown).publish(1)", "the message's type is not installed"),
    ("x = m.to_sec()", "to_sec is nanoseconds of rclpy's Time"),
    ("a = rospy.Time.now() - self.last.stamp", "both sides must be a Time or Duration of rclpy"),
    ("a = unknown() < rospy.Duration(1)", "both sides must be a Time or Duration of rclpy"),
    ("a = rospy.Duration(1) * 2", "rclpy's Time and Duration lack this operation"),
    ("a = rospy.Duration(1) + rospy.Duration(2)", "rclpy's Time and Duration lack this operation"),
    ("a = rospy.Time(1) > rospy.Duration(2)", "rclpy compares no times with durations"),
    ("a = not Imu().header.stamp", "a time of rclpy is true even if it is zero"),
    ("while rospy.Time.now(): pass", "a time of rclpy is true even if it is zero"),
    ("a = rospy.Time.now().secs", "rclpy's counterpart may have no secs"),
    ("a = Imu().header.stamp.is_zero()", "rclpy's counterpart may have no is_zero"),
    ("a = rospy.Publisher('a', String).resolved_name", "rclpy's counterpart may have no resolved_name"),
    ("r = rospy.Rate(1); a = r.remaining()", "rclpy's counterpart may have no remaining"),
    ("rospy.Timer(rospy.Duration(1), lambda e: print(e.last_real))", "rclpy's timers pass no event"),
    ("rospy.Timer(rospy.Duration(1), module.f)", "rclpy's timers pass no event to their callback"),
    ("import tf2_ros", "tf2_ros exists in ROS 2, but not on PyPI"),
    ("from message_filters import Subscriber", "message_filters exists in ROS 2, but not on PyPI"),
    ("import rosbag", "ROS 2 has no module rosbag"),
    ("import tf.transformations as t", "tf has become tf2_ros"),
    ("import sensor_msgs.point_cloud2 as pc2", "sensor_msgs_py.point_cloud2, which PyPI lacks"),
    ("from std_msgs.msg import Time", "builtin_interfaces.msg.Time takes its place"),
    ("from actionlib_tutorials.msg import FibonacciGoal", "actionlib_tutorials.msg.FibonacciGoal: goals"),
    ("b = Byte(1)", "a byte of a message is bytes of length 1 in ROS 2"),
    ("a = Byte().data > 0", "a byte of a message is bytes of length 1 in ROS 2"),
    ("a = Image().data == b''", "an array of numbers in a message of ROS 2 is no list and no bytes"),
    ("a = Image().data.decode()", "rclpy's counterpart may have no decode"),
    ("v = Vector3(); v.x, v.y = unknown()", "fields of messages need values of their exact types"),
    ("setattr(Vector3(), 'x', 1)", "fields of messages need values of their exact types"),
    ("unknown().position.x = 1", "this must be a float if it is a field of a message"),
    ("a = max([Imu().header.stamp, Imu().header.stamp])", "times of messages have no order in ROS 2"),
    ("unknown['a'].publish('x')", "publish takes a message only"),
    ("s = rospy.ServiceProxy('a', k); s = rospy.ServiceProxy('a', SetBool); s(True)", "clients of"),
    ("rospy.Service('a', SetBool, lambda r: unknown())", "rclpy requires a response of std_srvs/SetBool"),
    ("rospy.Service('a', SetBool, module.f)", "rclpy requires that this returns a response of std"),
    ("rospy.logerr('x', exc_info=True)", "the argument exc_info has no counterpart"),
    ("a = Imu.__slots__", "messages of ROS 2 have no __slots__"),
    ("a = isinstance(b, rospy.Time)", "ROS 2 has no such function"),
    ("x = rospy.get_param('~x', [1, 2.5])", "a parameter of ROS 2 is a number, a text, or an array"),
])  # fmt: skip
def test_what_is_not_sure_is_a_todo_with_its_reason(line: str, reason: str) -> None:
    draft = _draft(f"{HEAD}{line}\n")

    assert f"# TODO: {reason}" in draft.text
    assert [each.line for each in draft.changes if reason in each.reason] == [7]


def test_the_event_of_a_timer_is_a_todo_if_its_callback_uses_it() -> None:
    draft = _draft(f"{HEAD}def f(event):\n    print(event.current_real)\nrospy.Timer(rospy.Duration(1), f)\n")

    assert [each.line for each in draft.changes if "timers pass no event" in each.reason] == [8]
    assert (
        "    # TODO: rclpy's timers pass no event to their callback: this is None\n    print(event"
        in draft.text
    )


def test_variables_with_times_of_several_kinds_are_a_todo() -> None:
    source = "t = rospy.Time.now()\nt = Imu().header.stamp\nu = 1\na = t > u\n"
    assert "# TODO: both sides must be a Time" in _draft(f"{HEAD}{source}").text


def test_programs_without_init_node_get_a_node_and_modules_a_todo() -> None:
    module = "import rospy\ndef now():\n    return rospy.Time.now()\n"
    program = f"{module}if __name__ == '__main__':\n    print(now())\n"

    assert "# TODO: this file has no init_node: set node before" in _draft(module).text
    assert any(each.reason for each in _draft(module).changes)
    text = _draft(program).text
    assert "TODO" not in text
    assert text.endswith("':\n    rclpy.init()\n    node = rclpy.create_node('node')\n    print(now())\n")


def test_imported_names_are_those_that_a_package_has() -> None:
    draft = _draft("from std_msgs.msg import *\nimport rospy\np = rospy.Publisher('a', Int8)\np.publish(1)\n")

    assert draft.text.endswith("p = node.create_publisher(Int8, 'a', 10)\np.publish(Int8(data=1))\n")


def test_functions_are_added_after_the_imports_and_before_comments() -> None:
    source = "import rospy\nfrom math import (\n    pi,\n    sin,\n)\n# a comment\nrospy.spin()\n"

    text = _draft(source).text

    assert "    sin,\n)\n\n\ndef spin():" in text
    assert text.endswith("        rclpy.spin(node)\n# a comment\nspin()\n")


@pytest.mark.parametrize("name", NODES)
def test_each_draft_is_python_and_knows_no_rospy_outside_of_todos(name: str) -> None:
    draft = _draft(NODES[name])

    tree = ast.parse(draft.text)
    if "TODO" not in draft.text:
        assert "rospy" not in {each.id for each in ast.walk(tree) if isinstance(each, ast.Name)}


@pytest.mark.parametrize("expression", ["-" * 100_000 + "1", "+".join("1" * 900), "a" + ".b" * 3000])
def test_an_expression_that_is_nested_too_deeply_is_refused(expression: str) -> None:
    with pytest.raises(NotPortable, match="node: nested too deeply"):
        draft_of(f"import rospy\nx = {expression}\n", installed_definitions(), "node")


def test_drafts_wait_for_the_thread_of_callbacks_without_a_join_that_ctrl_c_interrupts() -> None:
    """After an interrupted `join`, Python takes the thread for ended, ends beside it, and aborts."""
    assert _draft("s = rospy.ServiceProxy('a', SetBool); rospy.spin()").text.count(".join()") == 1


def test_a_file_without_rospy_is_unchanged_and_python_2_is_refused() -> None:
    assert _draft("print('é')\n") == Draft((), "print('é')\n")
    with pytest.raises(NotPortable, match=r"<node>:1: not Python 3"):
        _draft("print 'x'\n")


def test_the_command_lists_changes_and_writes_drafts(tmp_path: Path, capsys) -> None:
    package = tmp_path / "demo"
    (package / "scripts").mkdir(parents=True)
    (package / "scripts" / "talker").write_text("#!/usr/bin/env python\n" + NODES["talker"])
    (package / "scripts" / "old.py").write_text("print 'x'\n")

    assert main(["--write", str(tmp_path / "out"), str(package)]) == 1
    printed = capsys.readouterr()
    assert (
        "scripts/talker:6: rospy.Publisher('chatter', String, queue_size=10) -> node.create_publisher("
        in printed.out
    )
    assert printed.err.startswith("scripts/old.py: left out: scripts/old.py:1: not Python 3")
    assert "rclpy.init()" in (tmp_path / "out" / "scripts" / "talker").read_text()
    assert main(["--write", str(tmp_path / "out"), str(package / "scripts" / "talker")]) == 0
    assert main(["--write", str(tmp_path / "out"), str(package / "scripts" / "talker")]) == 1
    assert "exists already" in capsys.readouterr().err
    assert (main([str(tmp_path / "none")]), main(["no_such_package"])) == (1, 1)
    assert "no_such_package is neither a file, a folder nor a package" in capsys.readouterr().err
    assert main(["rospy_tutorials"]) == 0
    assert "listener.py: " in capsys.readouterr().out


MANIFEST = """<package format="2">
  <name>demo</name><version>1.2.0</version><description>A &lt;demo&gt;</description>
  <maintainer email="a@example.org">A</maintainer><license>BSD</license>
  <buildtool_depend>catkin</buildtool_depend><build_depend>message_generation</build_depend>
  <depend>rospy</depend><depend>std_msgs</depend><depend>strange</depend>
  <exec_depend>python3-numpy</exec_depend>
</package>
"""
LAUNCH = """<launch>
  <arg name="speed" default="2"/>
  <param name="map" value="m"/>
  <include file="$(find demo)/launch/part.launch"/>
  <node pkg="demo" type="drive.py" name="drive" ns="left"
      args="$(find demo)/a.yaml --x" respawn="true">
    <remap from="in" to="out"/>
    <param name="speed" value="$(arg speed)"/>
    <param name="id" type="str" value="12"/>
    <param name="urdf" command="cat x"/>
    <rosparam>{limits: {low: -1.5, names: [a, b]}, top: .inf, mixed: [1, 2.5], odd: [1, a]}</rosparam>
  </node>
  <node pkg="rviz" type="rviz" name="rviz" args="-d '" required="true"/>
</launch>
"""
PART = '<launch><node pkg="demo" type="drive.py" name="other"><param name="id" value="x"/></node></launch>'
DRIVE = """#!/usr/bin/env python3
import rospy
rospy.init_node("drive")
a = rospy.get_param("~speed"), rospy.get_param("~id", "")
b = rospy.get_param("~limits/low", 0), rospy.get_param("/map")
"""


def _package(folder: Path) -> Path:
    package = folder / "package"
    for name, text in {
        "package.xml": MANIFEST, "launch/all.launch": LAUNCH, "launch/part.launch": PART,
        "launch/needs.launch": '<launch><arg name="x"/><node pkg="$(arg x)" type="a" name="a"/></launch>',
        "nodes/drive.py": DRIVE, "src/demo/__init__.py": "", "config/a.yaml": "",
    }.items():  # fmt: skip
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text)
    return package


def _stand_ins(monkeypatch: pytest.MonkeyPatch) -> None:
    """Install modules in place of ROS 2's launch, whose classes return their arguments."""
    for name, function in {
        "launch.LaunchDescription": list,
        "launch.actions.Shutdown": lambda: "shutdown",
        "launch_ros.actions.Node": dict,
        "launch_ros.parameter_descriptions.ParameterValue": lambda value, value_type: (value, value_type),
        "ament_index_python.packages.get_package_share_directory": lambda name: f"/share/{name}",
        "setuptools.setup": dict,
    }.items():
        module = types.ModuleType(name.rpartition(".")[0])
        setattr(module, name.rpartition(".")[2], function)
        monkeypatch.setitem(sys.modules, module.__name__, module)


def test_a_package_becomes_one_of_ament_python_with_launch_files(tmp_path: Path, capsys, monkeypatch) -> None:
    out = tmp_path / "out"
    assert main(["--write", str(out), str(_package(tmp_path))]) == 1

    printed = capsys.readouterr()
    assert re.search("launch/needs.launch: left out: .*x", printed.err)
    manifest = parse((out / "package.xml").read_text())
    assert manifest.attributes == {"format": "3"}
    needs = [each.text for each in manifest.all("exec_depend")]
    assert needs == ["launch_ros", "python3-numpy", "rclpy", "ros2launch", "std_msgs", "strange"]
    assert manifest.first("description").text == "A <demo>"  # type: ignore[union-attr]
    assert "package.xml: TODO: does ROS 2 have strange under this name?" in printed.out
    assert "package.xml: TODO: message_generation: own messages need" in printed.out
    assert (out / "resource" / "demo").read_text() == ""
    assert "install_scripts=$base/lib/demo\n" in (out / "setup.cfg").read_text()
    _stand_ins(monkeypatch)
    found: list[dict[str, Any]] = []
    monkeypatch.setattr(sys.modules["setuptools"], "setup", lambda **words: found.append(words))
    runpy.run_path(str(out / "setup.py"))
    assert (found[0]["packages"], found[0]["scripts"]) == (["demo"], ["nodes/drive.py"])
    launches = ["launch/all.launch.py", "launch/part.launch.py"]
    assert ("share/demo/launch", launches) in found[0]["data_files"]
    assert "setup.py: TODO: does the package need the files of 'config'?" in printed.out


def test_launch_files_keep_names_remappings_and_parameters(tmp_path: Path, capsys, monkeypatch) -> None:
    out = tmp_path / "out"
    main(["--write", str(out), str(_package(tmp_path))])

    _stand_ins(monkeypatch)
    text = (out / "launch" / "all.launch.py").read_text()
    names = runpy.run_path(str(out / "launch" / "all.launch.py"))
    assert names["generate_launch_description"]() == [
        {"package": "demo", "executable": "drive.py", "name": "other", "parameters": [{"id": "x"}]},
        {
            "package": "demo",
            "executable": "drive.py",
            "name": "drive",
            "namespace": "/left",
            "arguments": ["/share/demo/a.yaml", "--x"],
            "remappings": [("in", "out")],
            "parameters": [
                {
                    "speed": 2, "id": ("12", str), "limits.low": -1.5, "limits.names": ["a", "b"],
                    "top": math.inf, "mixed": [1.0, 2.5],
                }
            ],
            "respawn": True,
        },
        {"package": "rviz", "executable": "rviz", "name": "rviz", "on_exit": "shutdown"},
    ]  # fmt: skip
    printed = capsys.readouterr().out
    for reason in (
        "the argument speed has its default '2' here", "the nodes of part.launch are written here",
        "[/map] was on the parameter server", "is rviz/rviz in ROS 2, under these names?",
        "ROS 2 has no parameter for the value of ~odd", "arguments: No closing quotation: -d '",
        "urdf is the output of a command: cat x",
    ):  # fmt: skip
        assert f"launch/all.launch.py: TODO: {reason}" in printed
        assert f"# TODO: {reason}" in text
    # two values for id: the code's default remains
    node = (out / "nodes" / "drive.py").read_text()
    assert "a = get_param('speed', 2), get_param('id', \"\")\n" in node
    assert "b = get_param('limits.low', -1.5), get_param('map', 'm')\n" in node


@pytest.mark.parametrize("setting", [each for each in NODE_SETTINGS if each.xml and each.ros2])
def test_each_setting_of_nodes_that_ros2_has_is_in_a_draft(setting: NodeSetting, tmp_path: Path) -> None:
    text = {bool: "true", float: "2.5"}.get(type(setting.default), "log")
    attributes = {"pkg": "p", "type": "t", "name": "n", setting.xml: text}
    written = " ".join(f"{name}='{value}'" for name, value in attributes.items())
    (tmp_path / "a.launch").write_text(f"<launch><node {written}/></launch>")

    assert f"{setting.ros2}=" in LaunchDrafts(tmp_path, "p").files["a.launch.py"]


def test_a_folder_with_a_package_of_its_own_keeps_it(tmp_path: Path, capsys) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "package.xml").write_text("<package><name>mine</name></package>")
    package = _package(tmp_path)

    main(["--write", str(tmp_path / "out"), str(package)])

    assert f"package.xml: left out: {tmp_path}/out has its own" in capsys.readouterr().out
    assert not (tmp_path / "out" / "setup.py").exists()
    assert (tmp_path / "out" / "launch" / "all.launch.py").is_file()


def test_package_names_with_slashes_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    package = _package(tmp_path)
    (package / "package.xml").write_text(MANIFEST.replace("<name>demo<", "<name>../../demo<"))

    assert main(["--write", str(tmp_path / "out"), str(package)]) == 1
    assert "'../../demo' cannot be the name of a package" in capsys.readouterr().err
    assert not (tmp_path / "demo").exists()


@pytest.mark.parametrize("manifest", [b"<package", b"\xff\xfe", MANIFEST.replace("demo", "a b").encode()])
def test_a_bad_manifest_leaves_out_only_itself(tmp_path: Path, capsys, manifest: bytes) -> None:
    (tmp_path / "package.xml").write_bytes(manifest)
    (tmp_path / "talker.py").write_text("import rospy\nrospy.init_node('talker')\n")

    assert main([str(tmp_path), "--write", str(tmp_path / "out")]) == 1

    assert capsys.readouterr().err.startswith("package.xml: left out: ")
    assert "import rclpy" in (tmp_path / "out" / "talker.py").read_text()


# What was done by hand for benchmarks/port_drafts.py fits the drafts of today.


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_the_finished_drafts_are_those_of_today(tmp_path: Path) -> None:
    program = "import sys, port_drafts, pathlib; port_drafts.write_drafts(pathlib.Path(sys.argv[1]))"
    patch = benchmark("finished_drafts.patch")
    path = os.pathsep.join(str(package / "benchmarks") for package in PACKAGES)  # they import each other
    subprocess.run(
        [sys.executable, "-c", program, tmp_path], env={**os.environ, "PYTHONPATH": path}, check=True
    )

    check = ("git", "apply", "--check", "--unidiff-zero", patch)
    result = subprocess.run(check, cwd=tmp_path / "drafts", capture_output=True, text=True, check=False)

    assert (result.returncode, result.stderr) == (0, "")


# Which gateways reach ROS 2 on this machine only, and the rate limits of topics.


@pytest.mark.parametrize(("variables", "is_local"), [
    ({}, True), ({"ROS_DOMAIN_ID": "7"}, True), ({"ROS_LOCALHOST_ONLY": "1"}, True),
    ({"ROS_LOCALHOST_ONLY": "0"}, False), ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, False),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}, False),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, True),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_STATIC_PEERS": "192.168.1.5"}, True),
    ({"ROS_STATIC_PEERS": "127.0.0.1;localhost"}, True), ({"ROS_STATIC_PEERS": "192.168.1.5"}, False),
    ({"ROS_STATIC_PEERS": "robot"}, False),
])  # fmt: skip
def test_other_machines_are_reached_as_the_variables_say(variables: dict[str, str], is_local: bool) -> None:
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES)
    discovery = Discovery.from_environment(variables)

    assert GatewayOptions(discovery, GatewayRules(), pairs).is_local is is_local
    assert not GatewayOptions(discovery, GatewayRules(), pairs, routers=["tcp/localhost:7447"]).is_local


def test_a_discovery_server_of_rclpy_may_be_on_another_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    pairs = TypePairs(Distribution.JAZZY, BUILTIN_RULES)
    options = GatewayOptions(Discovery(), GatewayRules(), pairs, ros2_python="python3")

    assert options.is_local
    monkeypatch.setenv("ROS_DISCOVERY_SERVER", "192.168.1.5:11811")
    assert not options.is_local


def test_a_pace_admits_the_first_message_and_refuses_one_at_once() -> None:
    slow, fast = RateLimit(0.001), RateLimit(math.inf)

    assert [slow.admits() for _ in range(3)] == [True, False, False]
    assert all(fast.admits() for _ in range(3))


@pytest.mark.needs("/proc")
def test_a_gateway_hints_at_programs_that_announce_themselves_by_multicast_only() -> None:
    with free_domain() as domain, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:
        assert hint_for(Discovery(domain)) is None
        program.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        program.bind(("127.0.0.1", multicast_port(domain)))

        hint = hint_for(Discovery(domain))

        assert hint is not None
        assert "ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET" in hint
        assert hint_for(Discovery(domain, DiscoveryRange.SUBNET)) is None
