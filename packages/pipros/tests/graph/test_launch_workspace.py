"""A workspace from an empty folder in real shells: created, built, sourced, run and installed; its stubs."""

import shutil
import signal
import sys
from pathlib import Path

import pytest

from tests.support.genuine import is_required
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# A workspace from an empty folder in real shells: created, built, sourced, run and installed.


TALKER = """\
#!/usr/bin/env python3
from talkers.msg import Level
from talkers.words import GREETING
print(GREETING, Level(level="x").level, Level._md5sum, flush=True)
"""


def write_workspace(base: Path) -> Path:
    """Write a workspace with a package that has a message, a module and a script."""
    package = base / "src" / "talkers"
    for folder in ("msg", "scripts", "src/talkers"):
        (package / folder).mkdir(parents=True)
    (package / "package.xml").write_text(
        '<package format="2"><name>talkers</name><version>0.0.1</version><description>d</description>'
        '<maintainer email="a@example.org">A</maintainer><license>Apache-2.0</license>'
        "<buildtool_depend>catkin</buildtool_depend><build_depend>message_generation</build_depend>"
        "<exec_depend>message_runtime</exec_depend></package>"
    )
    (package / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.0.2)\nproject(talkers)\n"
        "find_package(catkin REQUIRED COMPONENTS rospy message_generation)\n"
        "catkin_python_setup()\nadd_message_files(FILES Level.msg)\ngenerate_messages()\n"
        "catkin_package(CATKIN_DEPENDS message_runtime)\n"
        "catkin_install_python(PROGRAMS scripts/talk.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})\n"
    )
    (package / "setup.py").write_text(
        "from setuptools import setup\nfrom catkin_pkg.python_setup import generate_distutils_setup\n"
        "setup(**generate_distutils_setup(packages=['talkers'], package_dir={'': 'src'}))\n"
    )
    (package / "msg" / "Level.msg").write_text("string level\n")
    (package / "src" / "talkers" / "__init__.py").touch()
    (package / "src" / "talkers" / "words.py").write_text("GREETING = 'hello'\n")
    (package / "scripts" / "talk.py").write_text(TALKER)
    (package / "scripts" / "talk.py").chmod(0o755)
    return base


@pytest.fixture
def workspace(ros: RosSystem) -> Path:
    """The workspace, not built yet."""
    return write_workspace(ros.home / "catkin_ws")


@pytest.fixture(scope="module")
def built(module_ros: RosSystem) -> Path:
    """The workspace after `catkin_make`, for tests that do not change it."""
    base = write_workspace(module_ros.home / "catkin_ws")
    catkin_make(module_ros, base).check(0)
    return base


def shell(ros: RosSystem, script: str, program: str = "bash") -> Process:
    return ros.pipros.run(program, "-c", script, timeout_s=120.0, ROS_PACKAGE_PATH="")


def catkin_make(ros: RosSystem, workspace: Path, *arguments: str) -> Process:
    return ros.pipros.run("catkin_make", "-C", workspace, *arguments, timeout_s=120.0, ROS_PACKAGE_PATH="")


def test_a_package_is_created_built_and_found(ros: RosSystem) -> None:
    ended = shell(
        ros,
        "mkdir -p ws/src && cd ws && catkin_make && cd src && "
        "catkin_create_pkg mine rospy std_msgs && cd .. && "
        "catkin_make && . devel/setup.bash && roscd mine && pwd && rospack depends1 mine",
    )
    assert ended.returncode == 0, ended.output
    assert "Created file mine/CMakeLists.txt" in ended.stdout
    assert ended.stdout[-3:] == [f"{ros.home}/ws/src/mine", "rospy", "std_msgs"]


@pytest.mark.parametrize("program", ["bash", "zsh", "sh"])
def test_a_sourced_workspace_runs_its_scripts(ros: RosSystem, built: Path, program: str) -> None:
    if shutil.which(program) is None:
        assert not is_required(), f"{program} is not installed, which this test needs"
        pytest.skip(f"no {program} here")
    ended = shell(ros, f". {built}/devel/setup.{program}; rosrun talkers talk.py", program)
    assert ended.returncode == 0, ended.output
    assert ended.stdout[-1].startswith("hello x ")


def test_modules_and_messages_are_importable_by_a_plain_python(ros: RosSystem, built: Path) -> None:
    ended = shell(
        ros,
        f". {built}/devel/setup.bash; cd /; "
        "python3 -c 'import talkers.words, talkers.msg; print(talkers.words.GREETING, talkers.msg.Level)'",
    )
    assert ended.stdout[-1].startswith("hello <class 'talkers.msg._Level.Level'>")


def test_sourcing_twice_changes_nothing(ros: RosSystem, built: Path) -> None:
    source = f". {built}/devel/setup.bash"
    ended = shell(ros, f"{source}; env > one; {source}; env > two")
    assert ended.returncode == 0, ended.output
    once, twice = (sorted((ros.home / name).read_text().splitlines()) for name in ("one", "two"))
    assert once == twice


def test_an_overlay_precedes_the_underlying_workspace(ros: RosSystem, built: Path) -> None:
    ended = shell(
        ros,
        f". {built}/devel/setup.bash; mkdir -p over/src && cd over && catkin_make > log && "
        "env -i PATH=$PATH HOME=$HOME bash -c "
        "'. devel/setup.bash; echo $CMAKE_PREFIX_PATH; rosrun talkers talk.py'",
    )
    assert ended.stdout[0] == f"{ros.home}/over/devel:{built}/devel"
    assert ended.stdout[-1].startswith("hello x ")


def test_an_installed_workspace_works_without_its_sources(ros: RosSystem, workspace: Path) -> None:
    assert catkin_make(ros, workspace, "install").returncode == 0
    shutil.rmtree(workspace / "src")
    shutil.rmtree(workspace / "devel")
    ended = shell(ros, f". {workspace}/install/setup.bash; rosrun talkers talk.py")
    assert ended.stdout[-1].startswith("hello x "), ended.output


def test_building_again_says_that_nothing_changed(ros: RosSystem, built: Path) -> None:
    again = catkin_make(ros, built)
    assert again.stdout[-1] == "Nothing has changed: 1 package is up to date"


def test_a_mistake_ends_with_1_and_names_its_line(ros: RosSystem, workspace: Path) -> None:
    file = workspace / "src" / "talkers" / "CMakeLists.txt"
    file.write_text(file.read_text().replace("generate_messages()", "generate_message()"))
    failed = catkin_make(ros, workspace)
    assert failed.returncode == 1
    assert f"CMake Error at {file}:6 (generate_message):" in failed.stdout
    assert '\033[31mInvoking "catkin_make" failed\033[0m' in failed.stderr


@pytest.mark.parametrize("where", ["nowhere", "catkin_ws/src/talkers", "catkin_ws/build"])
def test_only_a_workspace_can_be_built(ros: RosSystem, workspace: Path, where: str) -> None:
    (workspace / "build").mkdir()
    assert ros.pipros.run("catkin_make", "-C", ros.home / where).returncode == 1


def test_env_sh_runs_a_command_in_the_workspace(ros: RosSystem, built: Path) -> None:
    ended = ros.pipros.run(built / "devel" / "env.sh", "rosrun", "talkers", "talk.py", ROS_PACKAGE_PATH="")
    assert ended.stdout[-1].startswith("hello x ")


def test_the_shell_functions_find_files_and_complete(ros: RosSystem, built: Path) -> None:
    ended = shell(
        ros,
        f". {built}/devel/setup.bash; rosls talkers/msg; roscat talkers Level.msg; "
        "COMP_WORDS=(rosrun talkers ta); COMP_CWORD=2; _pipros_complete; echo ${COMPREPLY[@]}; "
        "COMP_WORDS=(roscd talkers/m); COMP_CWORD=1; _pipros_complete 2> /dev/null; echo ${COMPREPLY[@]}",
    )
    assert ended.stdout == ["Level.msg", "string level", "talk.py", "talkers/msg/"]


def test_the_own_python_runs_nodes_without_an_activated_environment(ros: RosSystem, workspace: Path) -> None:
    rosrun = Path(sys.executable).parent / "rosrun"
    ended = ros.pipros.run(
        rosrun, "talkers", "talk.py", PATH="/usr/bin:/bin", ROS_PACKAGE_PATH=str(workspace / "src")
    )
    assert ended.stdout[-1].startswith("hello x "), ended.output


def test_a_workspace_can_be_sourced_in_fish(ros: RosSystem, built: Path) -> None:
    fish = shutil.which("fish")
    if fish is None:
        pytest.skip("fish is not installed")
    source = f"source {built}/devel/setup.fish"

    ended = shell(
        ros,
        f"{source}; {source}; roscd talkers; and pwd; and rosrun talkers talk.py; "
        "and env | string match 'ROS_PACKAGE_PATH=*'",
        fish,
    )

    assert ended.returncode == 0, ended.output
    assert ended.stdout[0] == str(built / "src/talkers")
    assert ended.stdout[1].startswith("hello x ")
    assert ended.stdout[2].split(":")[0] == f"ROS_PACKAGE_PATH={built}/src"
    assert ended.stdout[2].count(f"{built}/src") == 1


# `pipros stubs --watch` keeps stubs current while definitions are edited.


MANIFEST = "<package><name>robot</name><version>1.0.0</version></package>"


def test_stubs_follow_the_definitions_past_a_mistake(ros: RosSystem, tmp_path: Path) -> None:
    messages = tmp_path / "robot" / "msg"
    messages.mkdir(parents=True)
    (messages.parent / "package.xml").write_text(MANIFEST)
    (messages / "Battery.msg").write_text("int32 level\n")
    folder = tmp_path / "typings"
    stub = folder / "robot/msg/__init__.pyi"
    watcher = ros.pipros.start(
        "pipros", "stubs", "--watch", "robot", "-o", str(folder), ROS_PACKAGE_PATH=str(tmp_path)
    )
    watcher.wait_for("msg/__init__.pyi")
    assert "level: int" in stub.read_text()

    (messages / "Battery.msg").write_text("int32\n")
    watcher.wait_for("Battery.msg:1")
    assert "level: int" in stub.read_text()
    (messages / "Battery.msg").write_text("string name\n")
    wait_until(lambda: "name: str" in stub.read_text())
    (messages / "Motor.msg").write_text("float64 current\n")
    wait_until(lambda: "class Motor" in stub.read_text())

    watcher.send_signal(signal.SIGINT, code=0)
