import io
import os
import re
from pathlib import Path
from typing import Any

import pytest

import rosclean as facade
from pipros.msg import load_message_class
from pipros_tools.cli import rosclean, roslaunch_deps
from pipros_tools.cli.rosconsole import main
from pipros_tools.cli.rosconsole.echo import LogPrinter


@pytest.fixture
def logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three runs of 3 MB, the third the newest."""
    folder = tmp_path / "log"
    for number in range(3):
        run = folder / f"run{number}"
        run.mkdir(parents=True)
        (run / "x.log").write_bytes(b"x" * 3_000_000)
        os.utime(run, (number, number))
    (folder / "latest").symlink_to(folder / "run0")
    monkeypatch.setenv("ROS_LOG_DIR", str(folder))
    return folder


def test_check_prints_the_size(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert rosclean.main(["check"]) == 0
    assert capsys.readouterr().out in ("8.6M ROS node logs\n", "8.7M ROS node logs\n")  # folders count, too


def test_python_code_can_ask_for_the_size(logs: Path, tmp_path: Path) -> None:
    assert 9_000_000 <= facade.get_disk_usage(str(logs)) < 9_100_000
    assert facade.get_human_readable_disk_usage(str(logs)) in ("8.6M", "8.7M")
    with pytest.raises(facade.CleanupException, match="must be a folder"):
        facade.get_disk_usage(str(tmp_path / "none"))
    facade.rosclean_main(["rosclean", "purge", "-y"])
    assert not logs.exists()
    with pytest.raises(SystemExit):
        facade.rosclean_main(["rosclean", "nonsense"])


def test_purge_deletes_everything_once_confirmed(logs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("n\n"))
    assert rosclean.main(["purge"]) == 0
    assert logs.is_dir()
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    assert rosclean.main(["purge"]) == 0
    assert not logs.exists()
    assert rosclean.main(["check"]) == 0


def test_purge_of_a_link_deletes_the_link_as_in_noetic(logs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (link := logs.with_name("link")).symlink_to(logs)
    monkeypatch.setenv("ROS_LOG_DIR", str(link))
    assert rosclean.main(["purge", "-y"]) == 0
    assert not link.is_symlink()
    assert len(list(logs.iterdir())) == 4


def test_purge_keeps_the_newest_up_to_a_size(logs: Path) -> None:
    assert rosclean.main(["purge", "-y", "--size", "4"]) == 0
    assert [path.name for path in logs.iterdir()] == ["run2"]


def test_no_subcommand_is_an_error() -> None:
    with pytest.raises(SystemExit) as end:
        rosclean.main([])
    assert end.value.code == 2


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    package = tmp_path / "src" / "mine"
    package.mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package><name>mine</name><exec_depend>declared</exec_depend></package>"
    )
    (package / "x.launch").write_text(
        '<launch><arg name="x"/><node pkg="declared" type="t" name="$(arg x)a"/>'
        '<node pkg="other" type="t" name="b"/><test pkg="mine" type="t" test-name="c"/></launch>'
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    return package / "x.launch"


def test_the_packages_of_a_launch_file_are_listed(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (roslaunch_deps.main([str(file)]), capsys.readouterr().out) == (0, "declared other\n")


def test_undeclared_dependencies_are_reported(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch_deps.main(["-w", str(file)]) == 0
    assert capsys.readouterr().out.splitlines()[-2:] == [
        "mine/package.xml:",
        "  <exec_depend>other</exec_depend>",
    ]


@pytest.mark.parametrize("words", [[], ["/nope.launch"]])
def test_without_a_launch_file_it_ends_with_2(words: list[str]) -> None:
    with pytest.raises(SystemExit) as end:
        roslaunch_deps.main(words)
    assert end.value.code == 2


# The output of `rosconsole echo`.


def log(level: int, text: str, name: str = "/talker") -> Any:
    message: Any = load_message_class("rosgraph_msgs/Log")()
    message.level, message.name, message.msg = level, name, text
    message.function, message.file, message.line = "main", "x.py", 7
    return message


def printed(*messages: Any, pattern: str = ".*", **options: Any) -> list[str]:
    lines: list[str] = []
    options = {"level": 4, "is_coloured": False, "is_verbose": False, **options}
    printer = LogPrinter(re.compile(pattern), write=lines.append, **options)
    for message in messages:
        printer.show(message)
    return lines


def test_only_statuses_at_or_above_the_level_are_printed() -> None:
    assert printed(log(2, "a"), log(4, "b"), log(16, "c")) == [
        "[ WARN  ] [/talker]: b",
        "[ FATAL ] [/talker]: c",
    ]


def test_the_filter_is_looked_for_in_the_name() -> None:
    assert printed(log(8, "a"), log(8, "b", name="/listener"), pattern="lis.*") == [
        "[ ERROR ] [/listener]: b"
    ]


def test_details_stand_on_a_line_of_their_own() -> None:
    (text,) = printed(log(8, "a"), is_verbose=True)
    assert re.fullmatch(r"\[ ERROR \] \[/talker\]: a\n {10}\[19.* \(0\.000000\)\] \[main\]: x\.py:7", text)


def test_colours_are_for_terminals() -> None:
    assert printed(log(8, "a"), is_coloured=True) == ["[ \x1b[91mERROR\x1b[0m ] [\x1b[1m/talker\x1b[22m]: a"]


def test_a_node_cannot_send_escape_sequences() -> None:
    assert printed(log(8, "a\x1b[2J\nb", name="/x\n")) == ["[ ERROR ] [/x\\n]: a\\x1b[2J\nb"]


def test_an_unknown_level_is_shown_as_its_number() -> None:
    assert printed(log(32, "a")) == ["[ 32    ] [/talker]: a"]


@pytest.mark.parametrize(("words", "complaint"), [
    (["list"], "you must specify a node to list loggers"),
    (["list", "a", "b"], "you may only specify one node to list"),
    (["get", "a"], "you must specify a node and a logger"),
    (["set", "a", "b"], "you must specify a node, a logger and a level"),
    (["echo", "-l", "loud"], "invalid choice"),
    (["echo", "["], "argument FILTER: [[] must be a regular expression"),
])  # fmt: skip
def test_mistakes_end_with_2(words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(words)
    assert end.value.code == 2
    assert complaint in capsys.readouterr().err


def test_an_unknown_subcommand_ends_with_64(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nonsense"]) == 64
    assert "rosconsole echo\tprint logger messages" in capsys.readouterr().out
