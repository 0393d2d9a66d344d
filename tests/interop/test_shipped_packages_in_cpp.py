"""Genuine catkin generates C++ from packages that come with pipros, once they are in a workspace."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from control_msgs.msg import FollowJointTrajectoryAction, PidState
from control_msgs.srv import QueryCalibrationState

from pipros.workspace.index import SHARED_PACKAGES
from tests.support.environments import genuine_environment

MANIFEST = """<package format="2"><name>uses</name><version>1.0.0</version><description>d</description>
<maintainer email="m@example.org">m</maintainer><license>none</license>
<buildtool_depend>catkin</buildtool_depend><depend>control_msgs</depend><depend>roscpp</depend></package>"""
CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(uses)
find_package(catkin REQUIRED COMPONENTS roscpp control_msgs)
catkin_package()
include_directories(${catkin_INCLUDE_DIRS})
add_executable(digests digests.cpp)
add_dependencies(digests ${catkin_EXPORTED_TARGETS})
"""
PROGRAM = """#include <control_msgs/FollowJointTrajectoryAction.h>
#include <control_msgs/PidState.h>
#include <control_msgs/QueryCalibrationState.h>
#include <iostream>
int main() {
  std::cout << ros::message_traits::md5sum<control_msgs::PidState>() << " "
            << ros::message_traits::md5sum<control_msgs::FollowJointTrajectoryAction>() << " "
            << ros::service_traits::md5sum<control_msgs::QueryCalibrationState>();
}
"""


@pytest.mark.timeout(300)
def test_a_cpp_program_uses_a_package_that_only_pipros_has(tmp_path: Path) -> None:
    source = tmp_path / "src"
    uses = source / "uses"
    uses.mkdir(parents=True)
    (source / "control_msgs").symlink_to(SHARED_PACKAGES / "control_msgs")
    (uses / "package.xml").write_text(MANIFEST)
    (uses / "CMakeLists.txt").write_text(CMAKE)
    (uses / "digests.cpp").write_text(PROGRAM)

    built = subprocess.run(
        ["catkin_make", "-C", str(tmp_path), "digests"],
        env=genuine_environment(tmp_path, "http://127.0.0.1:1") | {"CMAKE_PREFIX_PATH": "/usr"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )

    assert built.returncode == 0, built.stdout
    said = subprocess.run(
        [tmp_path / "devel/lib/uses/digests"], stdout=subprocess.PIPE, text=True, check=True
    )
    assert said.stdout.split() == [
        PidState._md5sum,
        FollowJointTrajectoryAction._md5sum,
        QueryCalibrationState._md5sum,
    ]
