"""Packages with C++ beside Python: genuine catkin builds them, and their Python nodes run on pipros."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

import rospy
from pipros_workspace.index import SHIPPED_FOLDERS
from pipros_workspace.native_tools import is_installed
from tests.support.debian_packages import FOUND_BY_CMAKE
from tests.support.environments import CPP_ONLY, file_of_tests, pipros_environment
from tests.support.once import make_once, shared_folder
from tests.support.ros import RosSystem, Side

MIXED = file_of_tests("packages/mixed")
RUNTIME = (
    "angles", "cv_bridge", "diagnostic_updater", "image_geometry", "interactive_markers",
    "joint_state_publisher", "robot_state_publisher", "rqt_graph", "xacro",
)  # fmt: skip
MANIFEST = """<package format="2"><name>finds</name><version>1.0.0</version><description>d</description>
<maintainer email="m@example.org">m</maintainer><license>none</license>
<buildtool_depend>catkin</buildtool_depend>{more}</package>"""
# Because of a generator expression, the package is passed to CMake.
CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(finds)
find_package(catkin REQUIRED COMPONENTS {names})
catkin_package()
add_custom_target(left_to_cmake COMMAND echo $<CONFIG>)
"""
SOURCED = ". devel/setup.bash && catkin_make"


@dataclass(frozen=True, slots=True)
class Build:
    """Return a command with its exit code and output."""

    command: str
    code: int
    output: str


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """A workspace with the package `mixed` and, in the last build, one that finds all packages of ROS."""
    base = shared_folder(tmp_path_factory, worker_id) / "mixed"

    def make() -> None:
        (base / "src").mkdir()
        builds = [build(base, "catkin_make")]
        shutil.copytree(MIXED, base / "src" / "mixed")
        builds += [build(base, SOURCED), build(base, SOURCED)]
        finds = base / "src" / "finds"
        finds.mkdir()
        more = "".join(f"<exec_depend>{name}</exec_depend>" for name in RUNTIME)
        (finds / "package.xml").write_text(MANIFEST.format(more=more))
        (finds / "CMakeLists.txt").write_text(CMAKE.format(names=" ".join(names_to_find())))
        builds.append(build(base, "catkin_make install"))
        (base / "builds.json").write_text(json.dumps([[b.command, b.code, b.output] for b in builds]))

    return make_once(base, make)


def names_to_find() -> list[str]:
    """Return the installed ROS packages, and the Python packages that only pipros includes."""
    shipped = {file.parent.name for share in SHIPPED_FOLDERS for file in share.glob("*/package.xml")}
    built = {file.parent.name for share in SHIPPED_FOLDERS for file in share.glob("*/CMakeLists.txt")}
    return [name for name in FOUND_BY_CMAKE if is_installed(name, {}) or name in shipped - built]


def build(workspace: Path, command: str) -> Build:
    environment = pipros_environment(workspace, "http://127.0.0.1:1", Path("/usr/bin"))
    environment.pop("ROS_PACKAGE_PATH")
    ended = subprocess.run(
        ["bash", "-c", command],
        cwd=workspace,
        env=environment | CPP_ONLY,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=280,
        check=False,
    )
    return Build(command, ended.returncode, ended.stdout)


def source(side: Side, setup: Path) -> None:
    """Give programs of pipros the environment of a terminal that sourced a setup file."""
    side.environment.pop("ROS_PACKAGE_PATH", None)
    listing = side.run("bash", "-c", f". '{setup}' && env -0").stdout[0]
    side.environment.update(entry.split("=", 1) for entry in listing.split("\0") if "=" in entry)


@pytest.mark.timeout(600)
def test_it_is_built_in_sourced_and_fresh_terminals_again_and_again(workspace: Path) -> None:
    builds = [Build(*entry) for entry in json.loads((workspace / "builds.json").read_text())]

    assert [entry.command for entry in builds] == ["catkin_make", SOURCED, SOURCED, "catkin_make install"]
    for entry in builds:
        assert entry.code == 0, entry.output
        assert "ROS_DISTRO was set" not in entry.output
    assert {"urdf", "tf2_eigen", "camera_info_manager", "angles", "rospy"} <= set(names_to_find())


@pytest.mark.timeout(600)
@pytest.mark.parametrize("space", ["devel", "install"])
def test_the_python_node_runs_on_pipros_beside_the_cpp_node(
    workspace: Path, plain_ros: RosSystem, space: str
) -> None:
    source(plain_ros.pipros, workspace / space / "setup.bash")

    check_that_all_works(plain_ros, workspace / space)


@pytest.mark.timeout(600)
def test_it_is_built_in_isolation_and_runs_on_pipros(plain_ros: RosSystem, tmp_path: Path) -> None:
    base = tmp_path / "isolated"
    shutil.copytree(MIXED, base / "src" / "mixed")

    built = build(base, "catkin_make_isolated")

    assert built.code == 0, built.output
    source(plain_ros.pipros, base / "devel_isolated" / "setup.bash")
    check_that_all_works(plain_ros, base / "devel_isolated" / "mixed")


def check_that_all_works(ros: RosSystem, prefix: Path) -> None:
    """Run both nodes with roslaunch and rosrun, and inspect them with the tools."""
    side = ros.pipros
    assert Path(side.environment["ROS_ROOT"]).is_dir()
    assert Path(side.environment["ROS_ETC_DIR"]).is_dir()
    expected = f'data: "north 1.5 7 {rospy.__file__}"'

    launch = side.start("roslaunch", "-p", str(ros.port), "mixed", "both.launch")
    ros.wait_for_publisher("/report", 60)
    ros.wait_for_publisher("/level", 60)

    assert side.run("rostopic", "echo", "-n1", "/report").stdout == [expected, "---"]
    assert side.run("rostopic", "echo", "-n1", "/level").stdout == ['tank: "north"', "height: 1.5", "---"]
    assert side.run("rosservice", "call", "/add", "40", "2").stdout == ["sum: 42"]
    assert side.run("rosmsg", "show", "mixed/Level").stdout[:2] == ["string tank", "float64 height"]
    examined = side.run("roswtf", timeout_s=60)
    assert examined.stdout.count("No errors or warnings") == 2, examined.output
    launch.press_ctrl_c()
    assert launch.wait(60) == 0, launch.output

    side.start_master()
    talker = side.start("rosrun", "mixed", "talker")
    listener = side.start("rosrun", "mixed", "listener.py", "report:=heard")
    ros.wait_for_publisher("/heard", 60)
    assert side.run("rostopic", "echo", "-n1", "/heard").stdout == [expected, "---"]
    for node in (listener, talker):
        node.press_ctrl_c()
        node.wait()
    programs = sorted(path.name for path in (prefix / "lib" / "mixed").iterdir() if path.suffix != ".lock")
    assert programs == ["listener.py", "talker"]
