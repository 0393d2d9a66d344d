"""A robot in xacro: loaded by a launch file, parsed by urdf_parser_py, its frames sent by two nodes."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pytest

from pipros.basics.extras import install_command
from pipros.msg.importing.hook import PackageFinder
from pipros.packages import ImportablePackages
from tests.support.robot import make_robot_package
from tests.support.ros import RosSystem

ASK = """import rospy, tf2_ros
from urdf_parser_py.urdf import URDF
robot = URDF.from_parameter_server()
print(robot.name, robot.get_root(), [joint.name for joint in robot.joints if joint.type == "revolute"])
rospy.init_node("ask")
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
for frame in ("upper", "finger", "camera"):
    moved = buffer.lookup_transform("base", frame, rospy.Time(0), rospy.Duration(30)).transform
    print(frame, *("%.3f" % getattr(moved.translation, axis) for axis in "xyz"))
"""


@pytest.fixture
def package(ros: RosSystem) -> Path:
    package = make_robot_package(ros.home / "src")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package.parent)
    return package


def test_a_launched_robot_has_its_frames(ros: RosSystem, package: Path) -> None:
    (package / "launch" / "all.launch").write_text(
        """<launch><include file="$(find arm_description)/launch/arm.launch"/>
        <node pkg="joint_state_publisher" type="joint_state_publisher" name="joint_state_publisher"/>
        <node pkg="robot_state_publisher" type="state_publisher" name="frames"/></launch>"""
    )
    launch = ros.pipros.start("roslaunch", "-p", str(ros.port), "arm_description", "all.launch")
    ros.wait_for_publisher("/tf")
    (ros.home / "ask.py").write_text(ASK)

    asked = ros.pipros.run("python3", ros.home / "ask.py", timeout_s=60)
    launch.press_ctrl_c()
    launch.wait()

    assert asked.stdout == [
        "arm base ['shoulder', 'elbow']",
        "upper 0.000 0.000 1.500",
        "finger 0.707 0.000 1.207",
        "camera 0.100 0.200 0.300",
    ], asked.output
    assert "use robot_state_publisher instead" in launch.output


def test_rosrun_xacro_expands_and_names_packages_that_are_unknown(ros: RosSystem, package: Path) -> None:
    file = package / "urdf" / "arm.urdf.xacro"
    expanded = ros.pipros.run("rosrun", "xacro", "xacro", "--inorder", file, "length:=8")
    missing = ros.pipros.run("rosrun", "xacro", "xacro", "nothing.xacro")
    file.write_text(file.read_text().replace("find arm_description", "find leg_description"))
    failed = ros.pipros.run("rosrun", "xacro", "xacro", file)

    assert expanded.returncode == 0, expanded.output
    assert any('<origin rpy="0 0.7853' in line and 'xyz="0 0 4.0"' in line for line in expanded.stdout)
    assert (missing.returncode, "No such file or directory" in missing.output) == (2, True)
    assert "Traceback" not in missing.output
    assert failed.returncode != 0
    assert "there is no package leg_description. Is its folder on ROS_PACKAGE_PATH" in failed.output


@pytest.mark.parametrize("program", ["joint_state_publisher", "robot_state_publisher"])
@pytest.mark.parametrize(
    ("description", "complaint"),
    [
        (None, "robot_description"),
        ("<robot/>", "must have no parent"),
        ("<robot", "unclosed token"),
        ("<map/>", "robot_description"),
        ("[1]", "robot_description"),
    ],
)
def test_a_description_that_is_missing_or_wrong_is_named(
    ros: RosSystem, program: str, description: str | None, complaint: str
) -> None:
    ros.pipros.start_bare_master()
    if description:
        ros.pipros.run("rosparam", "set", "robot_description", description)

    ended = ros.pipros.run("rosrun", program, program)

    assert ended.returncode == (1 if program == "joint_state_publisher" else 255)
    assert complaint in ended.output
    assert "Traceback" not in ended.output


@pytest.mark.parametrize("module", ["xacro", "urdf_parser_py"])
def test_a_missing_library_is_named_with_its_extra(module: str) -> None:
    packages = ImportablePackages()

    spec = PackageFinder(packages.find, packages.find_module).find_spec(module)

    assert spec is not None
    assert spec.loader is not None
    with pytest.raises(ModuleNotFoundError, match=f"{module} is not .*{re.escape(install_command('urdf'))}"):
        spec.loader.exec_module(ModuleType(module))


def test_a_publish_frequency_beyond_reason_is_limited(ros: RosSystem) -> None:
    """Check that the program prints the period of its timer."""
    ros.serve_master()
    ros.pipros.run(
        *("rosparam", "set", "robot_description"),
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="fixed">'
        '<parent link="a"/><child link="b"/></joint></robot>',
    )
    (ros.home / "node.py").write_text(
        "import sys, rospy, robot_state_publisher\n"
        "rospy.Timer = lambda period, *_, **__: print('period', period.to_nsec(), flush=True)\n"
        "sys.exit(robot_state_publisher.main())\n"
    )
    node = ros.pipros.start(
        "python3", "node.py", "_publish_frequency:=1000000000000.0", "_use_tf_static:=false"
    )
    node.wait_for("period 1000000$")
    node.press_ctrl_c()
    assert node.wait() == 0
