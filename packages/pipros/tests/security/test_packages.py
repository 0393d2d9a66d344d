"""Files of packages and workspaces that are none, never end, or exceed the limits."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.input_file import read_file, read_text
from pipros_tools.cli import roslaunch_complete, roslaunch_deps
from pipros_workspace.cmake.interpreter import Interpreter
from pipros_workspace.cmake.language import CMakeError
from pipros_workspace.cmake.scope import Scope
from pipros_workspace.index import SHIPPED_FOLDERS
from pipros_workspace.setup_files import write_setup_files
from roslaunch import depends
from tests.support.constants import Constants
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.workspaces import Workspace

# A `CMakeLists.txt` beyond the limits: the error names file and line, and the other packages are built.


_LONG = "string(REPEAT x 4000000 long)"
HOSTILE = {
    "character beyond all": "string(ASCII 99999999999 x)",
    "half a character": "string(ASCII 55296 x)\nmessage(${x})",
    "value that doubles": 'set(x xx)\nforeach(i RANGE 40)\n  set(x "${x}${x}")\nendforeach()',
    "value that grows": f'{_LONG}\nforeach(i RANGE 9)\n  string(APPEND x "${{long}}")\nendforeach()',
    "many large values": f'{_LONG}\nforeach(i RANGE 999)\n  set(x${{i}} "${{i}}${{long}}")\nendforeach()',
    "long arguments": f'{_LONG}\nmessage("${{long}}${{long}}")',
    "condition of long arguments": f'{_LONG}\nif("${{long}}${{long}}" STREQUAL "")\nendif()',
    "replacement": f'{_LONG}\nstring(REPLACE x "${{long}}" y xxxxxxxx)',
    "replacement by expression": f'{_LONG}\nstring(REGEX REPLACE . "${{long}}" y xxxxxxxx)',
    "joined texts": f'{_LONG}\nstring(JOIN "${{long}}" y a b c d)',
    "joined list": f'{_LONG}\nset(l a b c d)\nlist(JOIN l "${{long}}" y)',
    "changed list": f'{_LONG}\nset(l a b c d)\nlist(TRANSFORM l APPEND "${{long}}")',
    "selected places": "set(l a b)\nlist(TRANSFORM l TOUPPER FOR 0 9999999999999 REGEX)",
    "configured text": f'{_LONG}\nstring(CONFIGURE "@long@@long@" y)',
    "repeated text": "string(REPEAT x 9999999999 y)", "random text": "string(RANDOM LENGTH 9999999999 x)",
    "copied device": "configure_file(/dev/zero x)", "read device": "file(READ /dev/zero x)",
    "lines of a device": "file(STRINGS /dev/zero x)",
    "input of a program": "execute_process(COMMAND true INPUT_FILE /dev/zero)",
    "file without an end": "include(${CMAKE_CURRENT_SOURCE_DIR}/pipe)",
    "loop without an end": "while(1)\nendwhile()", "expression": "math(EXPR x 1/0)",
    "arguments of a macro": f"macro(m)\nendmacro()\n{_LONG}\nm(${{long}} ${{long}})",
    "element of a loop": f"foreach(i {'x' * 4_200_000})\nendforeach()",
    "expression in a condition": f'if("{"a" * 60}!" MATCHES "^(a+)+$")\nendif()',
    "expression in a string": f'string(REGEX MATCHALL "(a|aa)+$" x "{"a" * 90}!")',
    "expression in a replacement": f'string(REGEX REPLACE "(a+)+$" "" x "{"a" * 60}!")',
    "expression for a list": f'set(x "{"a" * 60}!")\nlist(FILTER x EXCLUDE REGEX "(a*)*$")',
    "expression for files": f'file(WRITE x "{"a" * 60}!")\nfile(STRINGS x y REGEX "(a+)+$")',
    "number of digits": "foreach(i RANGE 99999999999999999999999)\nendforeach()",
}  # fmt: skip


@pytest.fixture
def cmake_workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="needs /dev/zero")
@pytest.mark.parametrize("cmake", HOSTILE.values(), ids=HOSTILE)
def test_a_package_beyond_the_limits_fails_alone(cmake_workspace: Workspace, cmake: str) -> None:
    folder = cmake_workspace.add("bad", cmake)
    os.mkfifo(folder / "pipe")
    cmake_workspace.add("good")

    result = cmake_workspace.build()

    assert result.built == ["good"]
    [error] = result.errors
    assert "bad/CMakeLists.txt:" in error
    assert len(error) < 1_000


@pytest.mark.parametrize("body", ["set(x ${j})\n", ""])
def test_nested_loops_are_ended(tmp_path: Path, body: str, constants: Constants) -> None:
    constants(CMAKE_STEPS=1000)
    scope = Scope({}, {}, {})
    interpreter = Interpreter(
        scope, {}, check=lambda _command: None, on_unsupported=lambda _command, _what: None
    )
    text = f"foreach(i RANGE 99)\nforeach(j RANGE 99)\n{body}endforeach()\nendforeach()"

    with pytest.raises(CMakeError, match="more than 1000 commands were executed"):
        interpreter.run_text(text, str(tmp_path / "CMakeLists.txt"))


def test_local_variables_of_a_function_do_not_count_after_it_returns(constants: Constants) -> None:
    constants(CMAKE_CHARACTERS=1000)
    scope = Scope({}, {}, {})
    interpreter = Interpreter(
        scope, {}, check=lambda _command: None, on_unsupported=lambda _command, _what: None
    )

    interpreter.run_text(
        "function(f)\n  string(REPEAT x 200 local)\n  string(REPEAT y 10 mine)\n"
        "  set(result ${mine} PARENT_SCOPE)\nendfunction()\n"
        "foreach(i RANGE 20)\n  f()\nendforeach()\n"
        "foreach(i RANGE 20)\n  string(REPEAT x 200 again)\n  unset(again)\nendforeach()",
        "CMakeLists.txt",
    )

    assert scope.values["result"] == "y" * 10


# Setup files treat the name of a workspace's folder as data: no shell executes it.


NAMES = [
    'it"s mine', "it's mine", "a $(touch PWNED) b", "a `touch PWNED` b", "a ${HOME} $HOME %s {b}",
    "two\nlines", "back\\slash | touch PWNED", "a & touch PWNED", "(touch PWNED)", "Ünïcode #* ?[a]",
]  # fmt: skip
PRINT = 'printf %s "$ROS_PACKAGE_PATH"'
SHELLS = {
    "dash": ("dash", "-c", f'. "$1"; {PRINT}', "dash"),
    "bash": ("bash", "--norc", "-c", f'. "$1"; {PRINT}', "bash"),
    "zsh": ("zsh", "-f", "-c", f'. "$1"; {PRINT}', "zsh"),
    "fish": ("fish", "--no-config", "-c", f"source $argv[1]; {PRINT}"),
}
SHELLS["setup.bash in zsh"] = SHELLS["zsh"]
FILES = {"dash": "setup.sh", "bash": "setup.bash", "zsh": "setup.zsh", "fish": "setup.fish"}
FILES["setup.bash in zsh"] = "setup.bash"


def devel_space(folder: Path, underlays: tuple[Path, ...] = ()) -> Path:
    (folder / "src").mkdir(parents=True)
    write_setup_files(folder / "devel", [folder / "src"], underlays)
    return folder / "devel"


def run(folder: Path, *argv: str | Path) -> subprocess.CompletedProcess[str]:
    variables = {"PATH": "/usr/bin:/bin", "HOME": str(folder), "LANG": "C.UTF-8"}
    return subprocess.run(argv, cwd=folder, env=variables, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("shell", SHELLS)
def test_a_folder_of_any_name_can_be_sourced(tmp_path: Path, shell: str, name: str) -> None:
    program = shutil.which(SHELLS[shell][0])
    if program is None:
        pytest.skip(f"{shell} is not installed")
    underlay = devel_space(tmp_path / "below" / name)
    devel = devel_space(tmp_path / name, (underlay,))

    sourced = run(tmp_path, program, *SHELLS[shell][1:], devel / FILES[shell])

    assert sourced.stdout.split(os.pathsep) == [
        str(tmp_path / name / "src"), str(tmp_path / "below" / name / "src"), *map(str, SHIPPED_FOLDERS),
    ], sourced.stderr  # fmt: skip
    assert sourced.stderr == ""
    assert list(tmp_path.rglob("PWNED")) == []


@pytest.mark.parametrize("name", NAMES)
def test_commands_run_in_the_environment_of_a_folder_of_any_name(tmp_path: Path, name: str) -> None:
    devel = devel_space(tmp_path / name)

    ran = run(tmp_path, devel / "env.sh", "sh", "-c", PRINT)
    local = run(tmp_path, "sh", "-c", f'. "$1"; {PRINT}', "sh", devel / "local_setup.sh")

    expected = f"{tmp_path / name / 'src'}{os.pathsep}{os.pathsep.join(map(str, SHIPPED_FOLDERS))}"
    assert (ran.stdout, ran.stderr) == (expected, "")
    assert (local.stdout, local.stderr) == (expected, "")
    assert list(tmp_path.rglob("PWNED")) == []


# Programs that only read launch files do not run their commands; xacro is bounded wherever it runs.


@pytest.mark.parametrize("main", [roslaunch_deps.main, roslaunch_complete.main, depends.roslaunch_deps])
def test_a_program_that_reads_a_launch_file_runs_no_command(main: Any, tmp_path, capsys) -> None:
    file = tmp_path / "x.launch"
    file.write_text(
        f"<launch><arg name='a' default='1'/><param name='p' command='touch {tmp_path}/ran'/>"
        "<node pkg='std_msgs' type='t' name='n'/></launch>"
    )
    main([str(file)])
    assert not (tmp_path / "ran").exists()


NAMESPACE = "xmlns:xacro='http://www.ros.org/wiki/xacro'"


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork")
@pytest.mark.parametrize(
    ("expression", "reason"),
    [("9**9**9", "xacro: not done in time, so it was ended"), ("'x' * 10**10", "when evaluating expression")],
    ids=["time", "memory"],
)
def test_an_endless_expression_of_a_description_ends(ros: RosSystem, expression: str, reason: str) -> None:
    file = ros.home / "x.xacro"
    file.write_text(
        f"<robot {NAMESPACE}><xacro:property name='a' value=\"${{{expression}}}\"/>"
        "<link name='${a}'/></robot>"
    )
    ran = ros.pipros.run("rosrun", "xacro", "xacro", file, PIPROS_LIMITS="launch_command_s=3")
    assert ran.returncode != 0
    assert reason in ran.output


def test_a_usual_robot_description_is_not_bounded(ros: RosSystem) -> None:
    file = ros.home / "x.xacro"
    file.write_text(f"<robot {NAMESPACE} name='r'><link name='${{3 ** 3}}'/></robot>")
    ran = ros.pipros.run("rosrun", "xacro", "xacro", file)
    ran.check(0, '<link name="27"/>')


# Pipes and devices in place of untrusted files never block, and are not read into memory.


needs_device = pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="needs /dev/zero")

KINDS = ["pipe", "device", "link to a device"]


def plant(path: Path, kind: str) -> str:
    """Put a pipe or a device at the path, and return the path."""
    if kind == "device":
        return "/dev/zero"
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    return str(path)


@pytest.fixture
def source(ros: RosSystem) -> Path:
    """A folder with one good package, on ROS_PACKAGE_PATH."""
    folder = ros.home / "src"
    (folder / "good" / "msg").mkdir(parents=True)
    (folder / "good" / "package.xml").write_text("<package><name>good</name></package>")
    (folder / "good" / "msg" / "Plain.msg").write_text("int8 a\n")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    return folder


def device_run(ros: RosSystem, *argv: str) -> Process:
    """Run a tool that would not end, or exhaust this memory, if it read the planted file."""
    return ros.pipros.run("sh", "-c", 'ulimit -v 2000000; exec "$@"', "sh", *argv)


@needs_device
@pytest.mark.parametrize("kind", ["pipe", "link to a device"])
def test_a_manifest_that_is_not_a_file_is_not_a_package(ros: RosSystem, source: Path, kind: str) -> None:
    (source / "bad").mkdir()
    plant(source / "bad" / "package.xml", kind)

    found = device_run(ros, "rospack", "find", "good")
    missing = device_run(ros, "rosversion", "bad")
    listed = device_run(ros, "rosmsg", "packages")

    assert (found.returncode, found.stdout) == (0, [str(source / "good")])
    assert missing.returncode == 1
    assert "good" in listed.stdout


@needs_device
@pytest.mark.parametrize("kind", ["pipe", "link to a device"])
def test_a_definition_that_is_not_a_file_is_not_a_message(ros: RosSystem, source: Path, kind: str) -> None:
    plant(source / "good" / "msg" / "Bad.msg", kind)

    shown = device_run(ros, "rosmsg", "show", "good/Bad")
    plain = device_run(ros, "rosmsg", "show", "good/Plain")

    assert shown.returncode == 1
    assert plain.stdout[:1] == ["int8 a"]


@needs_device
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "content",
    [
        "<include file='{}'/>", "<rosparam file='{}'/>", "<param name='x' textfile='{}'/>",
        "<param name='x' binfile='{}'/>",
    ],
)  # fmt: skip
def test_a_launch_file_cannot_read_a_device(ros: RosSystem, content: str, kind: str) -> None:
    path = plant(ros.home / "planted", kind)
    file = ros.home / "x.launch"
    file.write_text(f"<launch>{content.format(path)}</launch>")

    loaded = device_run(ros, "roslaunch", "--nodes", str(file))

    loaded.check(1, f"cannot read [{path}]: it is not a regular file")


@needs_device
def test_the_output_of_a_command_in_a_launch_file_has_a_limit(ros: RosSystem) -> None:
    file = ros.home / "x.launch"
    file.write_text("<launch><param name='x' command='cat /dev/zero'/></launch>")

    loaded = ros.pipros.run("roslaunch", "--nodes", file, PIPROS_LIMITS="file_bytes=1000")

    loaded.check(1, "printed more than 1000 bytes")


@needs_device
@pytest.mark.parametrize(
    "command",
    ["sleep 30", "sh -c 'sleep 30 &amp; echo $! &gt; pid'", "sh -c 'exec &gt;&amp;-; exec sleep 30'"],
)
def test_a_command_in_a_launch_file_has_a_time_limit(ros: RosSystem, command: str) -> None:
    file = ros.home / "x.launch"
    file.write_text(f'<launch>\n<param name="x" command="{command}"/></launch>')

    loaded = ros.pipros.run("roslaunch", "--nodes", file, PIPROS_LIMITS="launch_command_s=0.1")

    if (started := ros.home / "pid").exists():  # keeps the pipe open
        os.kill(int(started.read_text()), signal.SIGKILL)
    loaded.check(1, f"{file}:2", "did not end in time, so it was ended: the limit is 0.1 (launch_command_s")


@needs_device
def test_results_of_tests_that_are_not_files_are_skipped(ros: RosSystem) -> None:
    results = ros.home / "results"
    results.mkdir()
    plant(results / "a.xml", "pipe")
    plant(results / "b.xml", "link to a device")

    counted = device_run(ros, "catkin_test_results", str(results))

    assert (counted.returncode, counted.stdout) == (0, ["Summary: 0 tests, 0 errors, 0 failures, 0 skipped"])


@needs_device
def test_a_file_is_read_up_to_its_limit(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"a\r\nb\n")

    assert (read_file(file, 5), read_text(file, 5)) == (b"a\r\nb\n", "a\nb\n")
    with pytest.raises(OSError, match="it is larger than 4 bytes"):
        read_file(file, 4)
