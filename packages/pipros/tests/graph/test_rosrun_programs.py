"""rosrun replaces its process with the program, including arguments, exit code and signals."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.programs import make_programs
from tests.support.ros import RosSystem


@pytest.fixture
def folder(ros: RosSystem) -> Path:
    """A package `programs`, alone on the package path."""
    package = make_programs(ros.home / "programs", {})
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package)
    return package


def script(folder: Path, name: str, content: str, mode: int = 0o755) -> Path:
    path = folder / name
    path.write_text(content)
    path.chmod(mode)
    return path


def test_the_program_takes_over_arguments_and_exit_code(ros: RosSystem, folder: Path) -> None:
    script(folder, "show", '#!/bin/sh\nfor word; do echo "$word"; done\nexit 7\n')
    ended = ros.pipros.run("rosrun", "programs", "show", "a b", "--debug", "x:=y", "__name:=n")
    assert ended.returncode == 7
    assert ended.stdout == ["a b", "--debug", "x:=y", "__name:=n"]


def test_rosrun_is_the_program_afterwards(ros: RosSystem, folder: Path) -> None:
    script(folder, "wait", "#!/bin/sh\necho pid $$\nexec sleep 1000\n")
    running = ros.pipros.start("rosrun", "programs", "wait")
    assert int(running.wait_for(r"pid (\d+)")[1]) == running.pid
    running.send_signal(signal.SIGTERM)
    assert running.wait() == -signal.SIGTERM


def test_python_nodes_get_the_python_that_pipros_is_in(ros: RosSystem, folder: Path) -> None:
    script(folder, "which.py", "#!/usr/bin/env python3\nimport sys, rospy\nprint(sys.prefix)\n")
    rosrun = Path(sys.executable).parent / "rosrun"
    ended = ros.pipros.run(rosrun, "programs", "which.py", PATH="/usr/bin:/bin")
    assert ended.stdout == [sys.prefix]


@pytest.mark.parametrize(
    ("content", "complaint", "code"),
    [
        ("import rospy\n", "make '#!/usr/bin/env python3' its first line", 126),
        ("#!/usr/bin/env python3\r\nimport rospy\r\n", "Windows line endings", 127),
        ("#!/no/such/ruby\n", "/no/such/ruby, which does not exist", 127),
    ],
)
def test_a_script_that_cannot_start_is_explained(
    ros: RosSystem, folder: Path, content: str, complaint: str, code: int
) -> None:
    script(folder, "bad.py", content)
    ended = ros.pipros.run("rosrun", "programs", "bad.py")
    assert ended.returncode == code
    assert complaint in ended.output


def test_a_missing_prefix_command_ends_with_127(ros: RosSystem, folder: Path) -> None:
    script(folder, "show", "#!/bin/sh\n")
    ended = ros.pipros.run("rosrun", "--prefix", "no_such_debugger", "programs", "show")
    assert ended.returncode == 127
    assert "no_such_debugger" in ended.output


def test_the_answer_selects_one_of_several(ros: RosSystem, folder: Path) -> None:
    for place in ("a", "b"):
        (folder / place).mkdir()
        script(folder / place, "show", f"#!/bin/sh\necho from {place}\n")
    ended = subprocess.run(
        ["rosrun", "programs", "show"],
        input="2\n",
        env=ros.pipros.environment,
        text=True,
        capture_output=True,
        check=False,
    )
    assert ended.returncode == 0
    assert ended.stdout.splitlines()[-1] == "from b"


@pytest.mark.parametrize("tool", ["roslaunch", "roslaunch-check", "roslaunch-deps"])
def test_the_tools_of_roslaunch_are_programs_of_their_package(ros: RosSystem, tool: str) -> None:
    assert ros.pipros.run("rosrun", "roslaunch", tool, "--help").returncode == 0


def test_the_logs_of_a_run_are_found_by_a_program_of_roslaunch(ros: RosSystem) -> None:
    ended = ros.pipros.run("rosrun", "roslaunch", "roslaunch-logs")
    assert (ended.returncode, ended.stderr) == (2, ["No active roscore"])


@pytest.mark.parametrize(
    "tool",
    [
        "rosbag",
        "rosclean",
        "rosmsg",
        "rosnode",
        "rosparam",
        "rosservice",
        "rostest",
        "rostopic",
        "rosunit",
        "roswtf",
    ],
)
def test_every_tool_is_a_program_of_its_package(ros: RosSystem, tool: str) -> None:
    ended = ros.pipros.run("rosrun", tool, tool, "-h")
    assert f"{tool}" in ended.output
    assert ended.returncode in (0, 64), ended.output


def test_a_script_for_python_2_is_named_with_its_remedy(ros: RosSystem) -> None:
    scripts = ros.home / "src" / "old" / "scripts"
    scripts.mkdir(parents=True)
    (scripts.parent / "package.xml").write_text("<package><name>old</name></package>")
    script = scripts / "talker.py"
    script.write_text("#!/usr/bin/env python3\nprint 'hello'\n")
    script.chmod(0o755)
    (scripts.parent / "old.launch").write_text('<launch><node pkg="old" type="talker.py" name="t"/></launch>')
    path = str(ros.home / "src")
    ended = ros.pipros.run("rosrun", "old", "talker.py", ROS_PACKAGE_PATH=path)
    assert ended.returncode == 1
    assert f"[rosrun] {script}:2 is Python 2, and Noetic runs Python 3: " in ended.output
    ros.pipros.start_master()
    launched = ros.pipros.start("roslaunch", "old", "old.launch", ROS_PACKAGE_PATH=path)
    launched.wait_for(r"\[t-1\] .*talker.py:2 is Python 2.*python -m fissix -w ")
