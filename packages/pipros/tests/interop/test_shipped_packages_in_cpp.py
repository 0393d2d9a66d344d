"""Genuine catkin generates C++ from packages included in pipros: linked, or passed by our catkin_make."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from control_msgs.msg import FollowJointTrajectoryAction, PidState
from control_msgs.srv import QueryCalibrationState
from map_msgs.msg import ProjectedMapInfo

from pipros_workspace.index import SHARED_PACKAGES
from tests.support.environments import CPP_ONLY, genuine_environment
from tests.support.ros import RosSystem

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
MAP_PROGRAM = """#include <map_msgs/ProjectedMapInfo.h>
#include <iostream>
int main() { std::cout << ros::message_traits::md5sum<map_msgs::ProjectedMapInfo>(); }
"""


@pytest.mark.timeout(600)
def test_a_cpp_program_uses_a_package_that_only_pipros_has(tmp_path: Path) -> None:
    add_package(tmp_path, MANIFEST, CMAKE, PROGRAM)
    (tmp_path / "src" / "control_msgs").symlink_to(SHARED_PACKAGES / "control_msgs")

    built = subprocess.run(
        ["catkin_make", "-C", str(tmp_path), "digests"],
        env=genuine_environment(tmp_path, "http://127.0.0.1:1") | {"CMAKE_PREFIX_PATH": "/usr"} | CPP_ONLY,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )

    assert built.returncode == 0, built.stdout
    assert said_by(tmp_path) == [
        PidState._md5sum,
        FollowJointTrajectoryAction._md5sum,
        QueryCalibrationState._md5sum,
    ]


@pytest.mark.timeout(600)
def test_catkin_make_of_pipros_adds_the_packages_that_genuine_ros_does_not_have(
    ros: RosSystem, tmp_path: Path
) -> None:
    manifest, cmake = (text.replace("control_msgs", "map_msgs") for text in (MANIFEST, CMAKE))
    add_package(tmp_path, manifest, cmake, MAP_PROGRAM)

    built = ros.pipros.run(
        *("catkin_make", "-C", tmp_path),
        timeout_s=400,
        PATH=f"{ros.pipros.environment['PATH']}{os.pathsep}/usr/bin:/bin",
        **CPP_ONLY,
    )

    assert built.returncode == 0, built.output
    assert (
        "-- map_msgs is not installed: its messages are built from those that come with pipros"
        in built.stdout
    )
    assert said_by(tmp_path) == [ProjectedMapInfo._md5sum]


def add_package(workspace: Path, manifest: str, cmake: str, program: str) -> None:
    uses = workspace / "src" / "uses"
    uses.mkdir(parents=True)
    (uses / "package.xml").write_text(manifest)
    (uses / "CMakeLists.txt").write_text(cmake)
    (uses / "digests.cpp").write_text(program)


def said_by(workspace: Path) -> list[str]:
    program = workspace / "devel/lib/uses/digests"
    return subprocess.run([program], stdout=subprocess.PIPE, text=True, check=True).stdout.split()
