from __future__ import annotations

import io
import os
from pathlib import Path

import pytest

import rosclean as facade
from pipros_tools.cli import rosclean, roslaunch_deps


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
