"""The shell of a tab's terminals."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros.tab.shell import run_line
from pipros.workspace.overlays import MARKER


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "environ", os.environ.copy())
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


def no_program(words: list[str], _output: str | None = None, *, waits: bool = True) -> int:
    raise AssertionError(words)


def typed(*lines: str) -> list[int]:
    return [run_line(line, no_program) for line in lines]


def test_folders_and_files_are_made_listed_and_shown(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    codes = typed(
        "mkdir -p ws/src && cd ws/src; pwd", 'echo "int64  num" > Num.msg', "cat Num.msg", "ls", "ls .."
    )
    assert codes == [0] * 5
    assert capsys.readouterr().out == f"{home}/ws/src\nint64  num\nNum.msg\nsrc\n"


def test_output_is_appended_and_files_are_removed(home: Path) -> None:
    assert typed("echo one > a", "echo two >> a") == [0, 0]
    assert (home / "a").read_text() == "one\ntwo\n"
    assert typed("mkdir b build", "rm a", "rm -r b", "rm -rf devel build", "rm devel") == [0, 0, 0, 0, 1]
    assert list(home.iterdir()) == []


@pytest.mark.parametrize(("mode", "after"), [("+x", 0o755), ("u+x", 0o744), ("a-r", 0o200), ("600", 0o600)])
def test_modes_are_changed(home: Path, mode: str, after: int) -> None:
    file = home / "talker.py"
    file.touch(0o644)
    assert typed(f"chmod {mode} talker.py") == [0]
    assert file.stat().st_mode & 0o777 == after


def test_programs_get_their_arguments_without_quotes(home: Path) -> None:
    (home / "a.bag").touch()
    (home / "b.bag").touch()
    started: list[list[str]] = []

    def run(words: list[str], _output: str | None = None, *, waits: bool = True) -> int:
        started.append(words)
        return 3

    os.environ["NAME"] = "world"
    line = """rostopic pub -1 /chatter std_msgs/String "data: 'hello $NAME'" """
    assert run_line(line, run) == 3
    assert run_line("rosbag info *.bag ~/c && rosrun never", run) == 3
    assert run_line("", run) == 0
    assert run_line("""rosparam set /a '$NAME "x"'""", run) == 3
    assert started == [
        ["rostopic", "pub", "-1", "/chatter", "std_msgs/String", "data: 'hello world'"],
        ["rosbag", "info", "a.bag", "b.bag", f"{home}/c"],
        ["rosparam", "set", "/a", '$NAME "x"'],
    ]


def test_errors_read_as_in_bash(capsys: pytest.CaptureFixture[str]) -> None:
    assert typed("cd nowhere", "cat nothing", "ls nothing", "source nothing", "chmod x", 'echo "open') == [
        1, 1, 1, 1, 1, 2
    ]  # fmt: skip
    assert capsys.readouterr().err.splitlines()[:3] == [
        "bash: cd: nowhere: No such file or directory",
        "cat: nothing: No such file or directory",
        "ls: nothing: No such file or directory",
    ]


def test_wrong_arguments_and_binary_files_do_not_close_the_terminal(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (home / "a.bag").write_bytes(b"\xff\n")
    assert typed("cp", "cp a.bag", "mv -f a.bag", "echo a\\", "cat a.bag") == [1, 1, 1, 1, 0]
    shown = capsys.readouterr()
    assert shown.err.splitlines() == [
        *("cp: missing file operand",) * 2,
        "mv: missing file operand",
        "echo: No escaped character",
    ]
    assert shown.out == "\N{REPLACEMENT CHARACTER}\n"


def test_programs_run_in_the_background_and_write_to_files(home: Path) -> None:
    started = []

    def run(words: list[str], output: str | None = None, /, *, waits: bool = True) -> int:
        started.append((words, output, waits))
        return 0

    assert run_line("roscore & rostopic list > topics; rosnode list", run) == 0
    assert started == [
        (["roscore"], None, False),
        (["rostopic", "list"], f"{home}/topics", True),
        (["rosnode", "list"], None, True),
    ]
    assert (home / "topics").read_text() == ""


def test_packages_are_entered_listed_and_copied_from(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert typed("roscp rospy_tutorials AddTwoInts.srv a.srv", "rosls rospy_tutorials/srv") == [0, 0]
    assert capsys.readouterr().out.startswith("AddTwoInts.srv  ")
    assert typed("roscd rospy_tutorials/srv", "cat AddTwoInts.srv") == [0, 0]
    assert capsys.readouterr().out == (home / "a.srv").read_text()
    assert typed("roscat rospy_tutorials AddTwoInts.srv") == [0]
    assert capsys.readouterr().out == (home / "a.srv").read_text()
    assert typed("roscd nothing", "rosls nothing", "roscp rospy_tutorials nothing a") == [1, 1, 1]
    assert (
        typed("roscat nothing", "roscat rospy_tutorials nothing", "roscat rospy_tutorials /tmp/a") == [1] * 3
    )
    assert "roscd: No such package/stack 'nothing'\n" in capsys.readouterr().err


def test_files_are_copied_and_moved(home: Path) -> None:
    assert typed("mkdir a", "touch a/b", "cp a/b c", "cp -r a d", "mv c d") == [0] * 5
    assert sorted(str(path.relative_to(home)) for path in home.rglob("*")) == ["a", "a/b", "d", "d/b", "d/c"]


def test_what_a_tab_lacks_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert typed("rostopic list | sort") == [2]
    assert capsys.readouterr().err == "bash: | is not available in a browser tab\n"


def test_the_exit_code_of_the_last_command_is_known(capsys: pytest.CaptureFixture[str]) -> None:
    typed("cat nothing; echo $?", "echo $?", "cat < nothing", "echo code $?")
    assert capsys.readouterr().out == "1\n0\ncode 2\n"
    assert run_line("rosrun; echo $?", lambda *_, **__: 3) == 0
    assert capsys.readouterr().out == "3\n"


def test_the_lines_of_other_files_are_run(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (home / ".bashrc").write_text("# mine\nsource /opt/ros/noetic/setup.bash\nexport A=b\n")
    assert typed("source ~/.bashrc", "echo $A") == [0, 0]
    assert capsys.readouterr().out == "b\n"


def test_source_names_a_setup_file_that_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / MARKER).touch()
    assert typed(f"source {tmp_path}/setup.bsh") == [1]
    assert capsys.readouterr().err == f"bash: source: {tmp_path}/setup.bsh: No such file or directory\n"


def test_source_sets_the_variables_of_ros(capsys: pytest.CaptureFixture[str]) -> None:
    os.environ.pop("ROS_DISTRO", None)
    assert typed("source /opt/ros/noetic/setup.bash", "export A=b; echo $ROS_DISTRO ${A}") == [0, 0]
    assert capsys.readouterr().out == "noetic b\n"
