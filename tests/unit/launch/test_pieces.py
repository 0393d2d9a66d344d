"""The small parts of the launcher: summary, console, log folder, guardian, options, files."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from pipros.env import Environment
from pipros.launch.console import Console
from pipros.launch.files import NoSuchFiles, resolve_files
from pipros.launch.guardian import read_groups
from pipros.launch.logs import LogFolder, LogFolderUnusable, disk_usage_report
from pipros.launch.model import LaunchError, Node
from pipros.launch.process import last_lines
from pipros.launch.run import RunOptions
from pipros.launch.summary import summary
from pipros.workspace.index import PackageIndex


def test_the_summary_is_the_one_of_noetic() -> None:
    params = {
        "/b": 1,
        "/a": "012345678901234567890",
        "/exact": "01234567890123456789",
        "/lines": "a\nb",
        "/l": ["aaaaaaa", "bbbbbbbb", "c"],
        "/u": "ä",
        "/bin": b"5\n",
    }
    nodes = [Node("p", "t", "z"), Node("p", "t", "a"), Node("p", "t", "n", "/g/")]
    assert summary(params, nodes).split("\n") == [
        "",
        "SUMMARY",
        "========",
        "",
        "PARAMETERS",
        " * /a: 01234567890123456...",
        " * /b: 1",
        " * /bin: 5",
        " * /exact: 01234567890123456789",
        " * /l: ['aaaaaaa', 'bbbb...",
        " * /lines: <...>",
        " * /u: <...>",
        "",
        "NODES",
        "  /",
        "    a (p/t)",
        "    z (p/t)",
        "  /g/",
        "    n (p/t)",
        "",
    ]


def test_the_console_prints_and_records(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    console = Console()
    console.open_log(tmp_path / "log")
    console.say("plain")
    console.bold("bold")
    console.title("title")
    console.detail("detail")
    console.error("wrong")
    console.close()
    captured = capsys.readouterr()
    assert captured.out == "plain\n\033[1mbold\033[0m\n\033]2;title\007\n"
    assert captured.err == "\033[31mwrong\033[0m\n"
    lines = (tmp_path / "log").read_text().splitlines()
    assert [line.rpartition(": ")[2] for line in lines] == ["plain", "bold", "detail", "wrong"]
    assert lines[0].startswith("[roslaunch][INFO] ")
    assert lines[3].startswith("[roslaunch][ERROR] ")


def test_a_title_can_be_left_out_and_details_be_shown(capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(has_title=False, is_verbose=True)
    console.title("title")
    console.detail("detail")
    assert capsys.readouterr().out == "detail\n"


def test_a_reader_that_went_away_disturbs_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    class Closed(io.StringIO):
        def write(self, text: str) -> int:
            raise BrokenPipeError

    monkeypatch.setattr("sys.stdout", Closed())
    Console().say("unheard")


def test_each_run_has_a_log_folder_and_latest_points_to_the_newest(tmp_path: Path) -> None:
    environment = Environment(log_dir=tmp_path / "log")
    LogFolder.of_run(environment, "one")
    second = LogFolder.of_run(environment, "two")
    assert (tmp_path / "log" / "latest").resolve() == second.path
    assert second.stem("g/h/n-2") == str(tmp_path / "log" / "two" / "g-h-n-2")
    second.check_writable()
    assert list(second.path.iterdir()) == []


def test_a_log_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(LogFolderUnusable, match="set ROS_LOG_DIR to another folder"):
        LogFolder.of_run(Environment(log_dir=tmp_path / "file" / "log"), "run")


def test_a_large_log_folder_is_warned_about(tmp_path: Path) -> None:
    assert disk_usage_report(tmp_path) == "Done checking log file disk usage. Usage is <1GB."
    with (tmp_path / "large").open("wb") as file:
        file.truncate(1_000_000_001)
    assert disk_usage_report(tmp_path).startswith(f"WARNING: disk usage in log directory [{tmp_path}]")


def test_the_guardian_knows_which_groups_are_left() -> None:
    lines = io.StringIO("+10\n+11\n+12\n-11\n+1\n+0\n+-5\ngarbage\n+13")
    assert read_groups(lines) == {10, 12, 13}


@pytest.mark.parametrize("name", ["sigint_timeout_s", "sigterm_timeout_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_timeouts_are_positive(name: str, value: float) -> None:
    with pytest.raises(LaunchError, match="must be a positive number, received"):
        RunOptions(**{name: value})  # type: ignore[arg-type]


def test_the_last_lines_of_a_file_are_those_that_say_something(tmp_path: Path) -> None:
    file = tmp_path / "log"
    file.write_text("x" * 10_000 + "\n" + "\n".join(f"line {number}" for number in range(9)) + "\n\n \n")
    assert last_lines(file, 2) == ["line 7", "line 8"]
    assert last_lines(tmp_path / "none") == []


@pytest.fixture
def index(tmp_path: Path) -> PackageIndex:
    package = tmp_path / "talkers"
    for path in ("launch/a.launch", "launch/twice.launch", "more/twice.launch", ".git/hidden.launch"):
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).touch()
    (package / "package.xml").write_text("<package><name>talkers</name></package>")
    return PackageIndex([tmp_path])


def test_launch_files_are_found_by_package_and_by_path(index: PackageIndex, tmp_path: Path) -> None:
    found = str(tmp_path / "talkers" / "launch" / "a.launch")
    assert resolve_files(["talkers", "a.launch"], index) == [found]
    assert resolve_files(["talkers", "launch/a.launch"], index) == [found]
    assert resolve_files([found], index) == [found]
    assert resolve_files([found, found], index) == [found, found]
    assert resolve_files(["talkers", "a.launch", found], index) == [found, found]
    assert resolve_files(["-"], index) == ["-"]
    assert resolve_files([], index) == []


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["nope.launch"], r"^\[nope.launch\] is not a launch file name"),
        (
            ["talkers", "nope.launch"],
            r"^\[nope.launch\] is neither a launch file in package \[talkers\] nor is \[talkers\] a launch",
        ),
        (["nope", "a.launch"], r"^\[a.launch\] is neither a launch file in package \[nope\]"),
        (["talkers", "hidden.launch"], "is neither"),
        (["talkers", "twice.launch"], r"^multiple files named \[twice.launch\] in package \[talkers\]:\n- "),
    ],
)
def test_launch_files_that_are_not_found_are_refused_in_noetics_words(
    index: PackageIndex, words: list[str], complaint: str
) -> None:
    with pytest.raises(LaunchError, match=complaint):
        resolve_files(words, index)


def test_all_missing_files_are_named(index: PackageIndex) -> None:
    with pytest.raises(NoSuchFiles) as error:
        resolve_files(["talkers", "a.launch", "x", "y"], index)
    assert error.value.files == ("x", "y")
