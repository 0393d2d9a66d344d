"""roscd, rosls, rosed, roscat, roscp, rosmv, rospd and rosd in the shells that have them."""

import re
import shutil
from pathlib import Path

import pytest

from pipros_workspace.setup_files import SHELL_FOLDER
from tests.support.environments import VENV_BIN
from tests.support.processes import Process
from tests.support.ros import RosSystem

COMPLETIONS = """
compopt() { :; }
try() {
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  _pipros_complete
  printf '<%s>' "${COMPREPLY[@]}"
  echo
}
try roscd robots
try roscd robots/
try rosed robots R
try rostopic pub /t robots/Wheel ''
"""

SHELLS = ["bash", "zsh", "fish"]


@pytest.fixture
def source(ros: RosSystem) -> Path:
    """A package `robots` with two files of the same name."""
    package = ros.home / "src" / "robots"
    for path, content in {
        "package.xml": "<package><name>robots</name></package>", "README": "read me\n",
        "a/same.txt": "of a\n", "b/same.txt": "of b\n", "b/two words.txt": "two words\n",
    }.items():  # fmt: skip
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).write_text(content)
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package.parent)
    return package


def shell(ros: RosSystem, program: str, script: str, **variables: str) -> Process:
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    return ros.pipros.run(program, "-c", f"source {SHELL_FOLDER}/ros.{program}; {script}", **variables)


@pytest.mark.parametrize("program", SHELLS)
def test_roscd_enters_packages_folders_workspace_and_logs(ros: RosSystem, source: Path, program: str) -> None:
    logs = ros.home / ".ros" / "log"
    (logs / "old").mkdir(parents=True)
    (ros.home / "devel").mkdir()
    (ros.home / "devel/.catkin").touch()
    ended = shell(
        ros, program, "roscd robots; pwd; roscd robots/a; pwd; roscd; pwd; "
        "roscd log; pwd; rosls log; roscd log/old; pwd",
        CMAKE_PREFIX_PATH=f"{ros.home}/devel:/usr",
    )  # fmt: skip
    assert ended.stdout == [
        str(source), str(source / "a"), str(ros.home / "devel"), str(logs), "old", str(logs / "old"),
    ]  # fmt: skip
    ended = shell(ros, program, "roscd; or true" if program == "fish" else "roscd; roscd nope; pwd")
    assert "No workspace is set up" in ended.output
    ended = shell(ros, program, "roscd nope; pwd")
    assert "roscd: No such package/stack 'nope'" in ended.output
    assert "Did you mean" not in ended.output
    assert "Did you mean robots" in shell(ros, program, "roscd robot/a; pwd").output
    assert ended.stdout[-1] == str(ros.home)
    assert shell(ros, program, "roscd --help").stdout[0] == "usage: roscd package"


@pytest.mark.parametrize("program", SHELLS)
def test_files_are_shown_edited_copied_and_moved(ros: RosSystem, source: Path, program: str) -> None:
    ended = shell(
        ros,
        program,
        "rosls robots; roscat robots README; roscat robots a/same.txt; roscat robots 'two words.txt'; "
        "rosed robots README; roscp robots README copy; cat copy; rosmv robots README moved; cat moved",
        EDITOR="echo edit",
    )
    assert ended.returncode == 0, ended.output
    assert ended.stdout == [
        *("README", "a", "b", "package.xml"),
        *("read me", "of a", "two words", f"edit {source}/README", "read me", "read me"),
    ]
    assert not (source / "README").exists()


@pytest.mark.parametrize("program", SHELLS)
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("roscat robots nope", "That file does not exist in that package."),
        ("roscat nope README", "Couldn't find package [nope]"),
        ("rosls nope", "rosls: No such package/stack 'nope'"),
        ("roscat robots", "usage: roscat [package] [file]"), ("rosed", "usage: rosed [package] [file]"),
    ],
)  # fmt: skip
def test_errors_exit_with_1(ros: RosSystem, source: Path, program: str, line: str, expected: str) -> None:
    ended = shell(ros, program, line)
    ended.check(1, expected)


@pytest.mark.parametrize("program", SHELLS)
def test_the_user_chooses_among_files_of_the_same_name(ros: RosSystem, source: Path, program: str) -> None:
    ended = shell(ros, program, "echo 2 | roscat robots same.txt")
    assert ended.stdout == ["of b"]
    assert "You have chosen a non-unique filename" in ended.output


@pytest.mark.parametrize("program", ["bash", "zsh"])
def test_rospd_and_rosd_keep_a_stack_of_folders(ros: RosSystem, source: Path, program: str) -> None:
    ended = shell(ros, program, "rospd robots; rospd robots/a; rospd 1; pwd")
    home = str(ros.home)
    assert ended.stdout == [
        *(f"0 {source}", f"1 {home}"), *(f"0 {source}/a", f"1 {source}", f"2 {home}"),
        *(f"0 {source}", f"1 {home}", f"2 {source}/a"), str(source),
    ]  # fmt: skip


def test_bash_completes_words_folders_and_messages(ros: RosSystem, source: Path) -> None:
    (source / "msg").mkdir()
    (source / "msg/Wheel.msg").write_text("string side\nint32 turns\n")
    ended = shell(ros, "bash", COMPLETIONS)
    assert ended.stdout == [
        *("<robots/>", "<robots/a/><robots/b/><robots/msg/>", "<README>", "<\"side: ''", 'turns: 0">')
    ]


@pytest.mark.parametrize("program", SHELLS)
def test_an_environment_without_a_workspace_has_the_functions(ros: RosSystem, program: str) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    load = "pipros env --shell fish | source" if program == "fish" else 'eval "$(pipros env)"'
    ended = ros.pipros.run(program, "-c", f"{load}; roscd turtlesim; pwd; echo $ROS_DISTRO")
    assert ended.stdout[-1] == "noetic"
    assert ended.stdout[-2].endswith("/share/turtlesim")


def test_a_plain_sh_evaluates_the_environment_without_the_functions(ros: RosSystem) -> None:
    ended = ros.pipros.run("sh", "-c", 'eval "$(pipros env)"; echo $ROS_DISTRO')
    assert ended.output.strip() == "noetic"


@pytest.mark.parametrize("program", SHELLS)
def test_commands_that_are_not_here_are_explained(ros: RosSystem, program: str) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    file = f"{SHELL_FOLDER}/ros.{program}"
    script = f"source {file}; source {file}; gazebo; catkin build; no_such_command; true"
    options = {"bash": "--norc", "zsh": "--no-rcs", "fish": "--no-config"}
    clean = {"PATH": f"{VENV_BIN}:{ros.home}"}  # without catkin, which may be installed
    typed = ros.pipros.run(shutil.which(program) or program, options[program], "-ic", script, **clean)
    assert "gazebo: The programs of gazebo_ros are written in C++" in typed.output
    assert "On this machine, roslaunch pipros_sim sim.launch" in typed.output
    assert "catkin: catkin is not part of pipros, but is on PyPI: pip install catkin-tools" in typed.output
    assert re.search(
        "no_such_command: command not found|(not found|Unknown command): no_such_command", typed.output
    )


def test_the_former_function_for_missing_commands_handles_the_others(ros: RosSystem) -> None:
    former = 'command_not_found_handle() { echo "distribution: $1"; }'
    load = f"{former}; source {SHELL_FOLDER}/ros.bash"
    typed = ros.pipros.run("bash", "--norc", "-ic", f"{load}; no_such_command")
    assert "distribution: no_such_command" in typed.stdout
    script = ros.pipros.run(
        "bash", "-c", f"{load}; gazebo_; declare -F _pipros_former_command_not_found_handle"
    )
    assert script.stdout == ["distribution: gazebo_"]
