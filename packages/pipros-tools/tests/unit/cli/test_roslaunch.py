from __future__ import annotations

import io
import subprocess
from pathlib import Path

import pytest

from pipros_tools.cli import roslaunch
from pipros_tools.launch.arguments import split_arguments

CONTENT = """\
<launch>
  <arg name="x" default="1" doc="the x"/>
  <arg name="fixed" value="2"/>
  <param name="p" value="$(arg x)"/>
  <rosparam>{a: {b: [1, 2]}}</rosparam>
  <rosparam command="delete" param="old"/>
  <env name="A" value="1"/>
  <node pkg="talkers" type="talker" name="one" args="'a b'" respawn="true"/>
  <group ns="g"><node pkg="talkers" type="nope" name="two"/></group>
  <test pkg="talkers" type="talker" test-name="tt"/>
</launch>
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    package = tmp_path / "src" / "talkers"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>talkers</name></package>")
    (package / "talker").write_text("#!/bin/sh\n")
    (package / "talker").chmod(0o755)
    (package / "x.launch").write_text(CONTENT)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    return package / "x.launch"


def test_nodes_lists_full_names(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["--nodes", "talkers", "x.launch"]) == 0
    assert capsys.readouterr().out == "/one\n/g/two\n/tt\n"


def test_files_lists_absolute_paths(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (roslaunch.main(["--files", str(file)]), capsys.readouterr().out) == (0, f"{file}\n")


def test_args_prints_a_command_line_for_a_shell(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["--args", "one", str(file)]) == 0
    assert capsys.readouterr().out == f'A="1" {file.parent}/talker a b __name:=one\n'


def test_args_escapes_what_is_special_in_a_shell(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    value = 'say "hi" to $HOME `id` \\'
    escaped = value.replace('"', "&quot;")
    file.write_text(
        file.read_text().replace('<env name="A" value="1"/>', f'<env name="A" value="{escaped}"/>')
    )
    assert roslaunch.main(["--args", "one", str(file)]) == 0
    (variable,) = capsys.readouterr().out.splitlines()
    shell = f'{variable.partition(" /")[0]}; printf %s "$A"'
    printed = subprocess.run(["sh", "-c", shell], capture_output=True, text=True, check=True)
    assert printed.stdout == value


def test_args_of_an_unknown_node_names_the_known_ones(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["--args", "xx", str(file)]) == 1
    assert capsys.readouterr().err == (
        f"ERROR: Cannot find node named [/xx] in [{file}].\nNode names are:\n * /one\n * /g/two\n * /tt\n"
    )


def test_args_of_a_node_without_a_program_fails(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["--args", "/g/two", str(file)]) == 1
    assert "Cannot locate node of type [nope]" in capsys.readouterr().err


def test_find_node_prints_its_file(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["--find-node", "g/two", str(file)]) == 0
    assert capsys.readouterr().out == f"{file}\n"
    assert roslaunch.main(["--find-node", "xx", str(file)]) == 0
    assert "ERROR: cannot find node named [/xx]" in capsys.readouterr().err


def test_ros_args_prints_the_arguments(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["--ros-args", str(file)]) == 0
    assert capsys.readouterr().out == 'Optional Arguments:\n  x (default "1"): the x\n'


def test_dump_params_prints_yaml(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["--dump-params", str(file), "x:=hello"]) == 0
    assert capsys.readouterr().out == "/a/b:\n- 1\n- 2\n/p: hello\n\n"


def test_dry_run_prints_everything_in_order(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["--dry-run", str(file)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        "rosparam delete /old",
        "rosparam set /a/b '[1, 2]'",
        "rosparam set /p 1",
        "",
        f"# /one (talkers/talker), respawn, output to log, from {file}:8:3",
        f"env A=1 {file.parent}/talker 'a b' __name:=one",
        "",
        f"# /g/two (talkers/nope), output to log, from {file}:9:17",
        "# ERROR: cannot launch node of type [talkers/nope]: Cannot locate node of type [nope] in package "
        "[talkers]. Make sure file exists in package path and permission is set to executable (chmod +x)",
    ]


def test_dry_run_runs_no_command_of_a_parameter(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.launch").write_text(
        f'<launch><param name="x" type="int" command="touch {tmp_path}/mark"/>'
        f'<group ns="g"><param name="y" command="touch {tmp_path}/mark"/></group></launch>'
    )
    assert roslaunch.main(["--dry-run", str(tmp_path / "a.launch")]) == 0
    assert not (tmp_path / "mark").exists()
    lines = [f'rosparam set /{name} "$(touch {tmp_path}/mark)"' for name in ("g/y", "x")]
    assert capsys.readouterr().out.splitlines() == lines


def test_a_launch_file_comes_from_standard_input(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO('<launch><node pkg="p" type="t" name="n"/></launch>'))
    assert (roslaunch.main(["--nodes", "-"]), capsys.readouterr().out) == (0, "/n\n")


@pytest.mark.parametrize("option", ["--nodes", "--files", "--ros-args", "--dry-run"])
def test_a_broken_file_is_an_error_for_every_inspection(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bad.launch").write_text("<launch><foo")
    assert roslaunch.main([option, str(tmp_path / "bad.launch")]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("Invalid roslaunch XML syntax: unclosed token")


def test_dump_params_prints_nothing_for_a_broken_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bad.launch"
    file.write_text("<launch><foo")
    assert roslaunch.main(["--dump-params", str(file)]) == 0
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"Unable to load file {file}: Invalid roslaunch XML syntax")


@pytest.mark.parametrize("option", ["--nodes", "--files", "--dump-params", "--ros-args"])
def test_an_inspection_warns_of_a_defunct_master_and_does_not_look_for_machines(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "x.launch"
    file.write_text('<launch><master/><node pkg="p" type="t" name="n" machine="unknown"/></launch>')
    assert roslaunch.main([option, str(file)]) == 0
    assert capsys.readouterr().err.startswith("WARNING: ignoring defunct <master /> tag")


@pytest.mark.parametrize(("words", "complaint"), [
    ([], "you must specify at least one input file"), (["--foo"], "no such option: --foo"),
    (["-c", "x", "f"], "--child"), (["-p", "x", "f"], "invalid integer value"),
])  # fmt: skip
def test_a_wrong_command_line_ends_with_2(
    words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        roslaunch.main(words)
    assert end.value.code == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("Usage: roslaunch [options] [package] <filename> [arg_name:=value...]")
    assert complaint in captured.err


def test_an_unknown_file_exits_with_1_and_noetics_text(capsys: pytest.CaptureFixture[str]) -> None:
    assert roslaunch.main(["nope.launch"]) == 1
    assert capsys.readouterr().err == (
        "\033[31mRLException: [nope.launch] is not a launch file name\033[0m\n"
        "\033[31mThe traceback for the exception was written to the log file\033[0m\n"
    )


def test_arguments_may_be_empty_and_may_contain_assignments() -> None:
    assert split_arguments(["a:=1", "f", "b:=", "c:=x:=y", ":=z"]) == (
        {"a": "1", "b": "", "c": "x:=y"},
        ["f", ":=z"],
    )
