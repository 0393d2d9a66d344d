"""Reported faults of catkin and genmsg."""

import shlex
from pathlib import Path

import pytest

from pipros_workspace.setup_py import SetupPyError, read_setup_py
from tests.support.ros import RosSystem

# ROS Answers: workspaces whose path has spaces or letters other than ASCII could not be built or sourced.


MANIFEST = """<package format="2"><name>spaced</name><version>0.1.0</version><description>ä</description>
<maintainer email="a@example.org">Jürgen Müller</maintainer><license>MIT</license>
<buildtool_depend>catkin</buildtool_depend><depend>rospy</depend><depend>message_generation</depend></package>
"""
CMAKE = """project(spaced)
find_package(catkin REQUIRED COMPONENTS rospy message_generation)
add_message_files(FILES Word.msg)
generate_messages()
catkin_package()
catkin_install_python(PROGRAMS scripts/say.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
"""
PROGRAM = """#!/usr/bin/env python3
import rospy
from spaced.msg import Word
rospy.init_node("say")
print("says", ascii(Word(rospy.get_param("~text")).text), ascii(rospy.get_param("~place")), flush=True)
"""
LAUNCH = """<launch><node pkg="spaced" type="say.py" name="say" output="screen" required="true">
<param name="text" value="größer"/><param name="place" value="$(find spaced)"/></node></launch>
"""


def test_a_workspace_with_spaces_is_built_sourced_and_launched(ros: RosSystem) -> None:
    folder = ros.home / "my wörk 'space"
    package = folder / "src" / "spaced"
    for name, text in {
        "package.xml": MANIFEST, "CMakeLists.txt": CMAKE, "msg/Word.msg": "string text\n",
        "scripts/say.py": PROGRAM, "launch/say.launch": LAUNCH,
    }.items():  # fmt: skip
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text, "utf-8")
    (package / "scripts/say.py").chmod(0o755)

    built = ros.pipros.run("catkin_make", "-C", str(folder), "install")
    assert built.returncode == 0, built.output

    for space, share in (("devel", package), ("install", folder / "install/share/spaced")):
        setup = shlex.quote(str(folder / space / "setup.bash"))
        ended = ros.pipros.run(
            "bash", "-c", f"source {setup} && exec roslaunch -p {ros.port} spaced say.launch"
        )
        assert f"says 'gr\\xf6\\xdfer' {str(share)!a}" in ended.output


# genmsg: files that an editor on Windows had saved with a byte order mark could not be read.


MARKED_CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(robot_pkg)
find_package(catkin REQUIRED)
catkin_package()
"""
MARKED_MANIFEST = """<package format="2"><name>robot_pkg</name><version>1.0.0</version>
<description>x</description>
<maintainer email="a@example.com">x</maintainer><license>x</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""
FILES = {
    "package.xml": MARKED_MANIFEST, "CMakeLists.txt": MARKED_CMAKE, "msg/Pose.msg": "float64 x # metres\n",
    "srv/Ask.srv": "int8 a\n---\nint8 b\n", "action/Go.action": "int8 a\n---\nint8 b\n---\nint8 c\n",
}  # fmt: skip


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
            "rosmsg show robot_pkg/Pose", "rosmsg show robot_pkg/GoGoal", "rossrv show robot_pkg/Ask",
        )
    ]  # fmt: skip
    assert shown == [["float64", "x"], ["int8", "a"], ["int8", "a", "---", "int8", "b"]]


# catkin: a setup.py that ended by sys.exit() made its package fail, and the reason was empty.


SETUP = "import sys\nfrom setuptools import setup\nsetup(packages=['p'])\nsys.exit({})\n"


@pytest.mark.parametrize("status", ["", "0", "None"])
def test_a_setup_that_exits_without_an_error_is_read(status: str, tmp_path: Path) -> None:
    (tmp_path / "setup.py").write_text(SETUP.format(status))
    assert list(read_setup_py(str(tmp_path)).packages) == ["p"]


def test_a_setup_that_exits_with_an_error_and_no_text_has_a_reason(tmp_path: Path) -> None:
    (tmp_path / "setup.py").write_text(SETUP.format("3"))
    with pytest.raises(SetupPyError, match=r"setup\.py failed:\n  it ended with exit status 3"):
        read_setup_py(str(tmp_path))
