"""The shell of a tab's terminals."""

import contextlib
import itertools
import os
import platform
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros_tab import shell
from pipros_tab.command_run import run_words
from pipros_tab.filters import run_before
from pipros_tab.shell import run_line
from pipros_workspace.overlays import MARKER


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "environ", os.environ.copy())
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


def no_program(words: list[str], _output: str | None = None, /, **_: object) -> int:
    raise AssertionError(words)


def typed(*lines: str) -> list[int]:
    return [run_line(line, no_program) for line in lines]


def test_folders_and_files_are_made_listed_and_shown(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    codes = typed(
        "mkdir -p ws/src && cd ws/src; pwd", 'echo "int64  num" > Num.msg', "cat Num.msg", "ls", "ls .."
    )
    assert codes == [0] * 5
    assert capsys.readouterr().out == f"{home}/ws/src\nint64  num\nNum.msg\nsrc\n"


def test_help_names_the_commands_and_nothing_needs_to_be_installed(capsys) -> None:
    assert typed("help", "sudo apt install ros-noetic-desktop", "pip install rospy", "date") == [0, 1, 1, 0]
    assert typed("USER=ada whoami") == [0]
    shown = capsys.readouterr()
    assert all(name in shown.out for name in ("catkin_make", "rosrun", "gedit", "Steps", " 20", "ada\n"))
    assert shown.err.count("nothing to install") == 2


def test_output_is_appended_and_files_are_removed(home: Path) -> None:
    assert (typed("echo one > a", "echo two >> a"), (home / "a").read_text()) == ([0, 0], "one\ntwo\n")
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

    def run(words: list[str], _output: str | None = None, /, **_: object) -> int:
        started.append(words)
        return 3

    os.environ["NAME"] = "world"
    line = """rostopic pub -1 /chatter std_msgs/String "data: 'hello $NAME'" """
    assert (run_line(line, run), run_line("rosbag info *.bag ~/c && rosrun never", run)) == (3, 3)
    assert (run_line("", run), run_line("""rosparam set /a '$NAME "x"'""", run)) == (0, 3)
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


def test_wrong_arguments_and_binary_files_do_not_close_the_terminal(home: Path, capsys) -> None:
    (home / "a.bag").write_bytes(b"\xff\n")
    assert typed("cp", "cp a.bag", "mv -f a.bag", "echo a\\", "cat a.bag") == [1, 1, 1, 2, 0]
    shown = capsys.readouterr()
    assert shown.err.splitlines() == [
        *("cp: missing file operand",) * 2,
        "mv: missing file operand",
        r"bash: unexpected EOF while looking for matching `\'",
    ]
    assert shown.out == "\N{REPLACEMENT CHARACTER}\n"


def test_programs_run_in_the_background_and_write_to_files(home: Path) -> None:
    started = []

    def run(words: list[str], output: str | None = None, /, *, waits: bool = True, **_: object) -> int:
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
    assert (
        typed(
            "rostopic list | sort", "rosnode list 2>&1", "cat << END", "ls |& wc", "cd $(rospack find rospy)"
        )
        == [2] * 5
    )
    assert capsys.readouterr().err.splitlines() == [
        "bash: after |, a browser tab has only grep, head, tail, wc, not sort",
        "bash: 2>& is not available in a browser tab", "bash: << is not available in a browser tab",
        "bash: |& is not available in a browser tab", "bash: $(rospack is not available in a browser tab",
    ]  # fmt: skip


def test_the_exit_code_of_the_last_command_is_known(capsys: pytest.CaptureFixture[str]) -> None:
    typed("cat nothing; echo $?", "echo $?", "cat < nothing", "echo code $?")
    assert capsys.readouterr().out == "1\n0\ncode 2\n"
    assert run_line("rosrun; echo $?", lambda *_, **__: 3) == 0
    assert capsys.readouterr().out == "3\n"
    typed("cd nowhere && echo never || echo else; echo after; ls nowhere && echo never; echo last")
    assert capsys.readouterr().out == "else\nafter\nlast\n"


def test_variables_are_set_for_one_command_or_for_the_shell(capsys: pytest.CaptureFixture[str]) -> None:
    started = []

    def run(words: list[str], _output: str | None = None, /, **_: object) -> int:
        started.append((words, os.environ.get("ROS_NAMESPACE")))
        return 0

    for line in (
        'ROS_NAMESPACE="robot 1" rosrun a b _c:="d e"', "NAME=x", "rosrun a $NAME ${NONE}", "printenv NAME",
    ):  # fmt: skip
        run_line(line, run)
    assert started == [(["rosrun", "a", "b", "_c:=d e"], "robot 1"), (["rosrun", "a", "x"], None)]
    assert typed("export NAME; printenv NAME", "A=1 env | grep ^A=") == [0, 0]
    assert capsys.readouterr().out == "x\nA=1\n"


def test_folders_are_left_and_entered_again(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shell._variables.pop("OLDPWD", None)
    assert typed("cd -", "mkdir a; cd a", "cd -", "cd -; pwd", "cd nowhere", "cd -") == [1, 0, 0, 0, 1, 0]
    shown = capsys.readouterr()
    assert shown.out.splitlines() == [str(home), *(f"{home}/a",) * 2, str(home)]
    assert shown.err.splitlines()[0] == "bash: cd: OLDPWD not set"


def test_programs_are_found(capsys: pytest.CaptureFixture[str]) -> None:
    assert typed("which rostopic rosrun", "which gcc rosrun", "which cd") == [0, 1, 1]
    first, second, third = capsys.readouterr().out.splitlines()
    assert Path(first).is_file()
    assert Path(second).is_file()
    assert second == third


def test_a_brace_after_a_variable_is_kept(capsys: pytest.CaptureFixture[str]) -> None:
    assert typed("X=5", 'echo "{data: $X}" {$X} ${X}} "${X}" \\$X') == [0, 0]
    assert capsys.readouterr().out == "{data: 5} {5} 5} 5 $X\n"


@pytest.mark.parametrize(("line", "code", "printed"), [
    ("cat a none b", 1, "one\ntwo\n"), ("grep -h a none b", 2, ""),
    ("grep o a none b", 2, "a:one\nb:two\n"), ("head -1 a none b", 1, "==> a <==\none\n==> b <==\ntwo\n"),
    ("grep a a", 1, ""), ("ls a none b", 1, "a\nb\n"), ("mkdir a c; ls", 0, "a  b  c\n"),
    ("rm none a; ls", 0, "b\n"), ("mkdir c; cp none a c; ls c", 0, "a\n"),
])  # fmt: skip
def test_a_missing_file_does_not_affect_the_others(
    line: str, code: int, printed: str, home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (home / "a").write_text("one\n")
    (home / "b").write_text("two\n")
    assert typed(line) == [code]
    shown = capsys.readouterr()
    assert shown.out == printed
    assert len(shown.err.splitlines()) == (line != "grep a a")


def test_words_are_expanded_as_in_bash(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    typed("mkdir -p ws/src a b", "ls; ls ws", "touch 'x y'", 'ls x*; echo "x*"')
    typed("echo '$HOME' # no", 'echo "\\$A" \'a\'"b"c "x  y"', "echo ${NONE} $NONE '$(ls)'")
    assert capsys.readouterr().out == "a  b  ws\nsrc\nx y\nx*\n$HOME\n$A abc x  y\n$(ls)\n"


def print_topics(_: list[str], output: str | None = None, /, **more: Any) -> int:
    """Do what a program does in a worker: print three names through the filters."""
    with open(output or os.devnull, "a", encoding="utf-8") as file:
        out = file if output else sys.stdout
        return run_before(more["filters"], lambda: print("/odom\n/scan\n/Odom/x") or 0, out)


@pytest.mark.parametrize(("line", "code", "printed"), [
    ("rostopic list | grep odom", 0, "/odom\n"),
    ("rostopic list | grep -i -n ODOM", 0, "1:/odom\n3:/Odom/x\n"),
    ("rostopic list | grep -v odom | head -1", 0, "/scan\n"),
    ("rostopic list | head -n 2 | tail -n 1", 0, "/scan\n"),
    ("rostopic list | tail -n 1; echo 2; echo 1&&ls", 0, "/Odom/x\n2\n1\n"),
    ("rostopic list | grep nothing", 1, ""), ("rostopic list | grep -v nothing | wc -l", 0, "3\n"),
    ("rostopic list | wc", 0, "3 3 20\n"), (r"rostopic list | grep '^/o\|^/s'", 0, "/odom\n/scan\n"),
    ("rostopic list | grep -E '^/(o|s)' > found; cat found", 0, "/odom\n/scan\n"),
    ("touch a b; ls | grep -n b", 0, "2:b\n"), ("A=1 env | grep ^A= && printenv A", 1, "A=1\n"),
    ("rostopic list | grep -Z", 2, ""),
])  # fmt: skip
def test_filters_read_what_commands_print(line: str, code: int, printed: str, capsys) -> None:
    assert (run_line(line, print_topics), capsys.readouterr().out) == (code, printed)


def test_a_program_ends_if_head_needs_no_more_lines(capsys: pytest.CaptureFixture[str]) -> None:
    def count() -> int:
        for number in itertools.count():
            print(number)
        return 0

    with pytest.raises(BrokenPipeError):
        run_before([["grep", "1"], ["head", "-2"]], count, sys.stdout)
    assert capsys.readouterr().out == "1\n10\n"


def test_a_program_that_ignores_the_end_of_head_is_interrupted(capsys: pytest.CaptureFixture[str]) -> None:
    def log() -> int:
        for number in itertools.count():
            with contextlib.suppress(BrokenPipeError):  # as logging does
                print(number)
        return 0

    with pytest.raises(KeyboardInterrupt):
        run_before([["head", "-1"]], log, sys.stdout)
    assert capsys.readouterr().out == "0\n"


def test_filters_read_files(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (home / "a/b").mkdir(parents=True)
    (home / "a/b/c").write_text("one\ntwo\n")
    (home / "d").write_text("two\nOne")
    assert typed("grep -n two a/b/c", "grep -r two", "grep -r One .", "grep -i one a/b/c d") == [0] * 4
    assert typed("head -1 a/b/c d", "tail -n1 d", "wc a/b/c", "wc -l d") == [0] * 4
    assert capsys.readouterr().out.splitlines() == [
        *("2:two", "a/b/c:two", "d:two", "d:One", "a/b/c:one", "d:One", "==> a/b/c <==", "one"),
        *("==> d <==", "two", "One2 2 8 a/b/c", "1 d"),
    ]
    wrong = ("grep two a", "grep no d", "grep x none", "grep [ d", "grep -Z d", "grep", "head -x d", "wc")
    assert typed(*wrong, "tail -n x d") == [2, 1, 2, 2, 2, 2, 1, 1, 1]
    assert capsys.readouterr().err.splitlines() == [
        "grep: a: Is a directory", "grep: none: No such file or directory",
        "grep: [: unterminated character set at position 0", "grep: invalid option -- 'Z'",
        "grep: a pattern is needed: grep [-Einrv] PATTERN [FILE]...", "head: invalid option -- 'x'",
        "wc: files are needed: the terminals of a browser tab pass no lines to commands",
        "tail: invalid number of lines: 'x'",
    ]  # fmt: skip


def test_the_lines_of_other_files_are_run(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (home / ".bashrc").write_text("# mine\nsource /opt/ros/noetic/setup.bash\nexport A=b\n")
    assert (typed("source ~/.bashrc", "echo $A"), capsys.readouterr().out) == ([0, 0], "b\n")


def test_source_names_a_setup_file_that_is_missing(tmp_path: Path, capsys) -> None:
    (tmp_path / MARKER).touch()
    assert typed(f"source {tmp_path}/setup.bsh") == [1]
    assert capsys.readouterr().err == f"bash: source: {tmp_path}/setup.bsh: No such file or directory\n"


def test_source_sets_the_variables_of_ros(capsys: pytest.CaptureFixture[str]) -> None:
    os.environ.pop("ROS_DISTRO", None)
    assert typed("source /opt/ros/noetic/setup.bash", "export A=b; echo $ROS_DISTRO ${A}") == [0, 0]
    assert capsys.readouterr().out == "noetic b\n"


# Command lines of a tab.


def test_python_prints_its_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert [run_words(["python3", option]) for option in ("--version", "-V")] == [0, 0]
    assert capsys.readouterr().out == f"Python {platform.python_version()}\n" * 2
