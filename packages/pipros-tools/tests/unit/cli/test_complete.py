"""Completion of the word at the cursor, without a master."""

from pathlib import Path

import pytest

from pipros_tools.cli import complete
from pipros_tools.cli.complete.options import words_after
from pipros_tools.cli.subcommands import subcommands


@pytest.fixture(autouse=True)
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package `robots` with a program, a launch file, a message and a service."""
    folder = tmp_path / "src" / "robots"
    for path, content in {
        "package.xml": "<package><name>robots</name></package>",
        "launch/go.launch": '<launch><arg name="speed"/><arg name="slow" default="1"/>'
        '<arg name="fixed" value="1"/></launch>',
        "launch/notes.txt": "n",
        "test/go.test": "<launch/>",
        "scripts/drive.py": "#!/usr/bin/env python3\n",
        "msg/Wheel.msg": "string side\nint32[2] turns\n",
        "srv/Stop.srv": "bool now\n---\n",
        ".git/go.launch": "",
    }.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(content)
    (folder / "scripts/drive.py").chmod(0o755)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("PATH", "/nowhere")  # without a genuine rosdep, which is asked for its options
    return folder


def offered(capsys: pytest.CaptureFixture[str], *words: str) -> list[str]:
    assert complete.main([str(len(words) - 1), *words]) == 0
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize(("line", "offers"), [
    ("rosrun robots", ["robots"]),
    pytest.param("rosrun robots ", ["drive.py"], marks=pytest.mark.needs("executable files")),
    ("rosrun robots drive.py ", []), ("rosrun nope ", []), ("rosrun --pre", ["--prefix"]),
    ("roslaunch robots ", ["go.launch", "go.test"]),
    ("roslaunch robots go.launch ", ["speed:=", "slow:="]),
    ("roslaunch robots go.launch sp", ["speed:="]), ("roslaunch --dry", ["--dry-run"]),
    ("rostest robots ", ["go.launch", "go.test"]), ("roscd robots", ["robots/"]),
    ("roscd robots/l", ["robots/launch/"]), ("roscd robots/ ", []), ("rosls --", ["--help"]),
    ("roscat robots n", ["notes.txt"]), ("rospack fi", ["find"]), ("rospack find robots", ["robots"]),
    ("roscd lo", ["log/"]),
    ("rostopic ec", ["echo"]), ("rostopic echo --fil", ["--filter"]),
    ("rostopic pub /t robo", ["robots/"]), ("rostopic pub /t robots/", ["robots/Wheel"]),
    ("rosmsg show robots/W", ["robots/Wheel"]), ("rosmsg package robots", ["robots"]),
    ("rosmsg list ", []), ("rossrv show robots/", ["robots/Stop"]), ("rosclean ", ["check", "purge"]),
    ("rosconsole ", ["echo", "get", "list", "set"]), ("rosconsole echo --nocol", ["--nocolor"]),
    ("rosdep ", ["check", "init", "install", "keys", "update"]), ("rosdep ins", ["install"]),
    ("rosdep check --from", ["--from-paths"]), ("rosdep check --from-paths ", []),
    ("rosstack fi", ["find"]), ("rosstack find robots", ["robots"]), ("pipros e", ["env"]),
    ("pipros env --ext", ["--extend"]), ("catkin_make run", ["run_tests"]),
    ("catkin_make --force", ["--force-cmake"]), ("rostopic echo ", []),
])  # fmt: skip
def test_offers(line: str, offers: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert offered(capsys, *line.split(" ")) == offers


def test_files_are_found_by_their_names_and_paths(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("go.launch", "launch/go.launch"):
        assert complete.main(["--find", "robots", name]) == 0
        assert capsys.readouterr().out == f"{package}/launch/go.launch\n"


@pytest.mark.needs("first lines")
def test_the_options_of_a_genuine_rosdep_are_completed(tmp_path: Path, capsys, monkeypatch) -> None:
    genuine = tmp_path / "rosdep"
    genuine.write_text('#!/bin/sh\n[ "$*" = "check --help" ] && echo "  --os=NAME  genuine"\n')
    genuine.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert offered(capsys, "rosdep", "check", "--") == ["--os"]


def test_every_subcommand_of_pipros_is_completed() -> None:
    assert {"doctor", "env", "stubs", "version"} <= set(words_after("pipros")) == set(subcommands())
