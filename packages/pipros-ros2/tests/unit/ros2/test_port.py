"""Drafts of rospy nodes for rclpy. `port_nodes.txt` contains 30 nodes in the style of public ones."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from pipros.ros2.commands.port import main
from pipros.ros2.interfaces.catalog import installed_definitions
from pipros.ros2.port.draft import Draft, NotPortable, draft_of

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
    ("rospy.Subscriber('a', String, f, 1)", "(String, 'a', lambda message: (f)(message, 1), 10)"),
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
    ("rospy.Timer(rospy.Duration(2), f)", "Duration(seconds=2).nanoseconds / 1e9, lambda: (f)(None))"),
    ("s = rospy.ServiceProxy('a', SetBool); s(True)", "s.call(SetBool.Request(data=True))"),
    ("r = SetBoolResponse(True, 'x')", "r = SetBool.Response(success=True, message='x')"),
]  # fmt: skip
HEAD = """import rospy
from std_msgs.msg import String
from geometry_msgs.msg import Twist, Vector3
from sensor_msgs.msg import Imu
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


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("p = rospy.Publisher('a', String); p.publish(unknown())", "publish takes a message of std"),
        ("x = rospy.get_param('/rate', 1)", "[/rate] was on the parameter server"),
        ("x = rospy.get_param(name)", "the name of a parameter must be a text here"),
        ("rospy.Timer(rospy.Duration(1), f, oneshot=True)", "rospy.Timer: the argument oneshot has no"),
        ("i = Imu(); print(i.header.seq)", "std_msgs/Header has no seq in ROS 2"),
        ("rospy.get_published_topics()", "ROS 2 has no such function"),
        ("x = f'{rospy.get_time()}'", "an f-string with rospy inside is not changed"),
        ("x = m.to_sec()", "to_sec is nanoseconds of rclpy's Time"),
    ],
)  # fmt: skip
def test_what_is_not_sure_is_a_todo_with_its_reason(line: str, reason: str) -> None:
    draft = _draft(f"{HEAD}{line}\n")

    assert f"# TODO: {reason}" in draft.text
    assert [each.line for each in draft.changes if reason in each.reason] == [7]


@pytest.mark.parametrize("name", NODES)
def test_each_draft_is_python_and_knows_no_rospy_outside_of_todos(name: str) -> None:
    draft = _draft(NODES[name])

    tree = ast.parse(draft.text)
    if "TODO" not in draft.text:
        assert "rospy" not in {each.id for each in ast.walk(tree) if isinstance(each, ast.Name)}


def test_a_file_without_rospy_is_unchanged_and_python_2_is_refused() -> None:
    assert _draft("print('é')\n") == Draft((), "print('é')\n")
    with pytest.raises(NotPortable, match=r"<node>:1: not Python 3"):
        _draft("print 'x'\n")


def test_the_command_lists_changes_and_writes_drafts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package = tmp_path / "demo"
    (package / "scripts").mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    (package / "scripts" / "talker").write_text("#!/usr/bin/env python\n" + NODES["talker"])
    (package / "scripts" / "old.py").write_text("print 'x'\n")

    assert main(["--write", str(tmp_path / "out"), str(package)]) == 1
    printed = capsys.readouterr()
    assert (
        "scripts/talker:6: rospy.Publisher('chatter', String, queue_size=10) -> node.create_publisher("
        in printed.out
    )
    assert "package.xml: TODO: catkin becomes" in printed.out
    assert printed.err.startswith("scripts/old.py: left out: scripts/old.py:1: not Python 3")
    assert "rclpy.init()" in (tmp_path / "out" / "scripts" / "talker").read_text()
    assert main(["--write", str(tmp_path / "out"), str(package / "scripts" / "talker")]) == 0
    assert main(["--write", str(tmp_path / "out"), str(package / "scripts" / "talker")]) == 1
    assert "exists already" in capsys.readouterr().err
    assert main([str(tmp_path / "none")]) == 1
    assert main(["no_such_package"]) == 1
    assert "no_such_package is neither a file, a folder nor a package" in capsys.readouterr().err
    assert main(["rospy_tutorials"]) == 0
    assert "listener.py: " in capsys.readouterr().out
