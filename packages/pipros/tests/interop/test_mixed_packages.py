"""Packages with C++ beside Python: genuine catkin builds them, and their Python nodes run on pipros."""

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
from control_msgs.msg import FollowJointTrajectoryAction, PidState
from control_msgs.srv import QueryCalibrationState
from map_msgs.msg import ProjectedMapInfo

import rospy
from pipros_workspace.index import SHARED_PACKAGES, SHIPPED_FOLDERS
from pipros_workspace.native_tools import is_installed
from tests.support.debian_packages import FOUND_BY_CMAKE
from tests.support.environments import CPP_ONLY, file_of_tests, genuine_environment, pipros_environment
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
        ["bash", "-c", command], cwd=workspace, env=environment | CPP_ONLY, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, timeout=280, check=False,
    )  # fmt: skip
    return Build(command, ended.returncode, ended.stdout)


def source(side: Side, setup: Path) -> None:
    """Give programs of pipros the environment of a terminal that sourced a setup file."""
    side.environment.pop("ROS_PACKAGE_PATH", None)
    listing = side.run("bash", "-c", f". '{setup}' && env -0").stdout[0]
    side.environment.update(entry.split("=", 1) for entry in listing.split("\0") if "=" in entry)


def test_it_is_built_in_sourced_and_fresh_terminals_again_and_again(workspace: Path) -> None:
    builds = [Build(*entry) for entry in json.loads((workspace / "builds.json").read_text())]

    assert [entry.command for entry in builds] == ["catkin_make", SOURCED, SOURCED, "catkin_make install"]
    for entry in builds:
        assert entry.code == 0, entry.output
        assert "ROS_DISTRO was set" not in entry.output
    assert {"urdf", "tf2_eigen", "camera_info_manager", "angles", "rospy"} <= set(names_to_find())


@pytest.mark.parametrize("space", ["devel", "install"])
def test_the_python_node_runs_on_pipros_beside_the_cpp_node(workspace, plain_ros, space: str) -> None:
    source(plain_ros.pipros, workspace / space / "setup.bash")

    check_that_all_works(plain_ros, workspace / space)


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


# One package with C++ that fails takes neither its Python part nor other packages along.
PARTIAL_MANIFEST = """<package format="2"><name>{name}</name><version>1.0.0</version>
<description>d</description>
<maintainer email="m@example.org">m</maintainer><license>none</license>
<buildtool_depend>catkin</buildtool_depend>{more}</package>"""
PARTIAL_CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED{components})
catkin_package()
{more}
catkin_install_python(PROGRAMS scripts/hello.py DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}})
"""
COMPILED = """add_executable({name} main.cpp)
install(TARGETS {name} DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}})"""
HELLO = "#!/usr/bin/env python3\nprint('hello')\n"


def add(
    source: Path, name: str, cmake: str = "", needs: str = "", code: str = "int main() {}\n", find: str = ""
) -> None:
    folder = source / name
    (folder / "scripts").mkdir(parents=True)
    (folder / "scripts" / "hello.py").write_text(HELLO)
    (folder / "scripts" / "hello.py").chmod(0o755)
    (folder / "main.cpp").write_text(code)
    more = f"<depend>{needs}</depend>" if needs else ""
    (folder / "package.xml").write_text(PARTIAL_MANIFEST.format(name=name, more=more))
    components = f" COMPONENTS {find}" if find else ""
    more = cmake.format(name=name)
    (folder / "CMakeLists.txt").write_text(PARTIAL_CMAKE.format(name=name, components=components, more=more))


def test_everything_but_the_failing_programs_is_built(plain_ros: RosSystem) -> None:
    workspace = plain_ros.home / "ws"
    source = workspace / "src"
    add(source, "good", COMPILED)
    add(source, "no_config", f"find_package(NoSuchThing REQUIRED)\n{COMPILED}")
    add(source, "no_component", COMPILED, find="no_such_component")
    add(source, "no_compile", COMPILED, code="nonsense;\n")
    add(source, "needs_config", COMPILED, needs="no_config")
    add(source, "only_python", needs="no_config", find="move_base_that_is_absent")
    side = plain_ros.pipros
    side.environment["PATH"] += ":/usr/bin"
    side.environment.pop("ROS_PACKAGE_PATH")

    built = side.run("catkin_make", "-C", workspace, "install", timeout_s=200)

    assert built.returncode == 1
    failed = built.output[built.output.index("3 package(s) failed") :]
    assert "no_config: CMake Error at no_config/CMakeLists.txt:5 (find_package): By not providing" in failed
    assert '"NoSuchThing", but CMake did not find one.' in failed
    assert "no_component: CMake Error at" in failed
    assert "no_compile: " in failed
    # Errors name the user's file, not the link to it below `build`.
    own = f"{source}/no_compile/"
    assert f"no_compile: {own}" in failed
    assert "error: " in failed[failed.index("no_compile: ") :].splitlines()[0]
    assert built.output.count(f"{own}") > 1
    assert "native/src/no_compile" not in built.output
    assert "skipped: needs_config (needs no_config)" in failed
    assert "only_python compiles nothing, so it is built anyway" in built.output
    for space in ("devel", "install"):
        programs = workspace / space / "lib"
        for name in ("good", "no_config", "no_component", "no_compile", "needs_config", "only_python"):
            assert (programs / name / "hello.py").is_file(), (space, name)
        assert (programs / "good" / "good").is_file()
        assert not (programs / "needs_config" / "needs_config").exists()

    (source / "no_compile" / "main.cpp").write_text("int main() {}\n")
    again = side.run("catkin_make", "-C", workspace, timeout_s=200)
    assert "2 package(s) failed" in again.output
    assert (workspace / "devel" / "lib" / "no_compile" / "no_compile").is_file()


# Genuine catkin generates C++ from packages included in pipros: linked, or passed by our catkin_make.
USES_MANIFEST = """<package format="2"><name>uses</name><version>1.0.0</version><description>d</description>
<maintainer email="m@example.org">m</maintainer><license>none</license>
<buildtool_depend>catkin</buildtool_depend><depend>control_msgs</depend><depend>roscpp</depend></package>"""
USES_CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(uses)
find_package(catkin REQUIRED COMPONENTS roscpp control_msgs)
catkin_package()
include_directories(${catkin_INCLUDE_DIRS})
add_executable(digests digests.cpp)
add_dependencies(digests ${catkin_EXPORTED_TARGETS})
"""
USES_PROGRAM = """#include <control_msgs/FollowJointTrajectoryAction.h>
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


def test_a_cpp_program_uses_a_package_that_only_pipros_has(tmp_path: Path) -> None:
    add_package(tmp_path, USES_MANIFEST, USES_CMAKE, USES_PROGRAM)
    (tmp_path / "src" / "control_msgs").symlink_to(SHARED_PACKAGES / "control_msgs")

    built = subprocess.run(
        ["catkin_make", "-C", str(tmp_path), "digests"],
        env=genuine_environment(tmp_path, "http://127.0.0.1:1") | {"CMAKE_PREFIX_PATH": "/usr"} | CPP_ONLY,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
    )  # fmt: skip

    assert built.returncode == 0, built.stdout
    assert said_by(tmp_path) == [
        PidState._md5sum, FollowJointTrajectoryAction._md5sum, QueryCalibrationState._md5sum,
    ]  # fmt: skip


def test_catkin_make_of_pipros_adds_the_packages_that_genuine_ros_does_not_have(ros, tmp_path) -> None:
    manifest, cmake = (text.replace("control_msgs", "map_msgs") for text in (USES_MANIFEST, USES_CMAKE))
    add_package(tmp_path, manifest, cmake, MAP_PROGRAM)

    built = ros.pipros.run(
        *("catkin_make", "-C", tmp_path), timeout_s=400,
        PATH=f"{ros.pipros.environment['PATH']}{os.pathsep}/usr/bin:/bin", **CPP_ONLY,
    )  # fmt: skip

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
