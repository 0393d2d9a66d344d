"""genmsg: files that an editor on Windows had saved with a byte order mark could not be read."""

from __future__ import annotations

from pathlib import Path

from tests.support.ros import RosSystem

CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(robot_pkg)
find_package(catkin REQUIRED)
catkin_package()
"""
MANIFEST = """<package format="2"><name>robot_pkg</name><version>1.0.0</version><description>x</description>
<maintainer email="a@example.com">x</maintainer><license>x</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""
FILES = {
    "package.xml": MANIFEST,
    "CMakeLists.txt": CMAKE,
    "msg/Pose.msg": "float64 x # metres\n",
    "srv/Ask.srv": "int8 a\n---\nint8 b\n",
    "action/Go.action": "int8 a\n---\nint8 b\n---\nint8 c\n",
}


def test_definitions_and_cmake_files_may_begin_with_a_mark(ros: RosSystem, tmp_path: Path) -> None:
    package = tmp_path / "src" / "robot_pkg"
    for name, text in FILES.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_bytes(text.replace("\n", "\r\n").encode("utf-8-sig"))
    made = ros.pipros.run("catkin_make", "-C", str(tmp_path))
    assert made.returncode == 0, made.output
    shown = [
        ros.pipros.run(*command.split(), ROS_PACKAGE_PATH=str(tmp_path / "src")).output.split()
        for command in (
            "rosmsg show robot_pkg/Pose",
            "rosmsg show robot_pkg/GoGoal",
            "rossrv show robot_pkg/Ask",
        )
    ]
    assert shown == [["float64", "x"], ["int8", "a"], ["int8", "a", "---", "int8", "b"]]
