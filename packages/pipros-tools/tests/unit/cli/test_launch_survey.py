"""`roslaunch-check --survey` and `--csv`: who provides the programs that launch files name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipros_tools.cli.roslaunch_check import main

HEAD = "file,in_package,element,pkg,type,nodelet,language\n"


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace, which is not on ROS_PACKAGE_PATH, with one package."""
    robot = tmp_path / "robot"
    robot.mkdir()
    (robot / "package.xml").write_text("<package><name>robot</name></package>")
    (robot / "drive.py").write_text("#!/usr/bin/env python3\n")
    (robot / "drive.py").chmod(0o755)
    monkeypatch.setenv("ROS_PACKAGE_PATH", "")
    return tmp_path


def survey(*words: str | Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    code = main([str(word) for word in words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def owner(output: str, name: str) -> list[str]:
    """Return what the table says of a name: who provides it, and in how many files and places it is named."""
    return re.findall(rf"^(\S.*?) +(\d+) +(\d+)  {re.escape(name)}(?: \((.*)\))?$", output, re.M)[0]


def test_the_survey_of_a_tree_says_who_provides_each_program(
    tree: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tree / "robot/one.launch").write_text("""<launch>
      <arg name="kind" default="tf2_ros"/> <arg name="plugin"/>
      <group if="$(arg sometimes)">
        <node name="t" pkg="$(arg kind)" type="static_transform_publisher"/>
      </group>
      <node name="a" pkg="robot" type="drive.py"/> <node name="b" pkg="robot" type="compiled"/>
      <node name="c" pkg="nodelet" type="nodelet" args="load pcl/VoxelGrid manager in:=points"/>
      <node name="d" pkg="nodelet" type="nodelet" args="load image_proc/resize $(arg manager)"/>
      <node name="e" pkg="nodelet" type="nodelet" args="standalone $(arg plugin)"/>
      <include file="$(find gone)/x.launch"><arg name="y" value="$(find robot)/y"/></include>
    </launch>""")
    (tree / "robot/two.test").write_text("""<launch>
      <test test-name="t" pkg="robot" type="drive.py"/> <node name="f" pkg="$(arg any)" type="g"/>
      <node name="m" pkg="moveit_ros_move_group" type="move_group"/>
    </launch>""")
    (tree / "robot/three.launch.xml").write_text('<launch><node name="j" pkg="amcl" type="amcl"/></launch>')
    (tree / "robot/model.xml").write_text('<robot><node pkg="no" type="no"/></robot>')
    (tree / "robot/broken.xml").write_text("<robot")

    code, output, errors = survey("--survey", tree, capsys=capsys)

    assert (code, errors) == (1, "")
    for name, row in {
        "tf2_ros/static_transform_publisher": ("shipped", "1", "1", ""),
        "amcl/amcl": ("shipped", "1", "1", ""),
        "pcl/VoxelGrid": ("shipped", "1", "1", ""),
        "robot": ("workspace", "1", "1", ""),
        "robot/drive.py": ("workspace", "2", "2", ""),
        "robot/compiled": ("not built", "1", "1", ""),
        "image_proc/resize": ("Debian", "1", "1", "apt-get install libimage-proc-dev"),
        "moveit_ros_move_group/move_group": ("missing", "1", "1", ""),
        "gone": ("missing", "1", "1", ""),
        "$(arg any)/g": ("argument", "1", "1", ""),
    }.items():
        assert owner(output, name) == row
    assert output.endswith("3 launch files, 1 of them without a missing program\n")
    (tree / "robot/one.launch").unlink()
    (tree / "robot/two.test").unlink()
    assert survey("--survey", tree, capsys=capsys)[0] == 0


@pytest.mark.parametrize(("name", "text", "message"), [
    ("a.launch", "<launch><node></launch>", "a.launch:1:"),
    ("a.launch", "<robot/>", "a.launch:1:1: no root <launch> tag"),
    ("a.test", '<!DOCTYPE x [<!ENTITY e "e">]><launch/>', "a.test:1:"),
])  # fmt: skip
def test_a_malformed_launch_file_is_named_after_the_table(
    tree: Path, name: str, text: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tree / name).write_text(text)
    (tree / "good.launch").write_text('<launch><node name="n" pkg="amcl" type="amcl"/></launch>')

    code, output, errors = survey("--survey", tree, capsys=capsys)

    assert (code, owner(output, "amcl/amcl")[0]) == (2, "shipped")
    assert errors.startswith("ERROR: ")
    assert message in errors


def test_a_csv_file_gives_the_figures_with_and_without_packages(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "nodes.csv").write_text(
        HEAD + "1,a,node,amcl,amcl,,cpp\n1,a,node,a,a.py,,py\n2,a,node,amcl,amcl,,cpp\n"
        "2,a,node,nodelet,nodelet,manager,cpp\n2,a,node,nodelet,nodelet,pcl/VoxelGrid,cpp\n"
        "3,b,node,b,b,,cpp\n4,b,,,,,\n5,b,test,b,b,,cpp\n6,c,node,c,c.py,,py\n7,c,node,gone,gone,,cpp\n"
    )

    code, output, errors = survey("--csv", tmp_path / "nodes.csv", "--without", "amcl,pcl_ros", capsys=capsys)

    assert (code, errors) == (1, "")
    assert owner(output, "b/b") == ("not built", "2", "2", "")
    assert owner(output, "gone/gone") == ("missing", "1", "1", "")
    assert owner(output, "c/c.py") == ("workspace", "1", "1", "")
    assert "9 nodes, 7 (77 %) of them in C++, from 4 packages, 0 of which also have nodes in Python" in output
    assert "start nothing: 1, only Python: 1, C++ only in tests: 1, C++ nodes: 4" in output
    figures = dict(re.findall(r"^ +(\S.*?) +(\d+ +\d+)(?:  has)?$", output, re.M))
    assert {name: row.split() for name, row in figures.items()} == {
        "a package of each name": ["0", "2"],
        "each program and nodelet": ["0", "2"],
        "amcl": ["2", "2"],  # the last table: 2 files with 2 nodes
        "b": ["1", "1"],
        "gone": ["1", "1"],
        "nodelet": ["1", "2"],
    }
    assert re.search(r"^    amcl +1 +0$", output, re.M)  # file 1 lacks nothing else


@pytest.mark.parametrize(("content", "message"), [
    (b"", "must start with the line file,in_package"),
    (b"a,b\n", "must start with the line file,in_package,element,pkg,type,nodelet,language, got 'a,b'"),
    (HEAD.encode() + b"1,a,node,amcl\n", "line 2: needs 7 columns, got 4"),
    (HEAD.encode() + b'1,a,node,amcl,"am\n', "is not a CSV file"),
    (HEAD.encode() + b"\xff\n", "is not a CSV file"), (None, "cannot read"),
])  # fmt: skip
def test_a_malformed_csv_file_is_an_error(
    tmp_path: Path, content: bytes | None, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "nodes.csv"
    if content is not None:
        file.write_bytes(content)

    code, output, errors = survey("--csv", file, capsys=capsys)

    assert (code, output) == (2, "")
    assert errors.startswith("ERROR: ")
    assert str(file) in errors
    assert message in errors


@pytest.mark.parametrize("words", [["--survey"], ["--csv", "a", "b"], ["--csv", "a", "--survey"]])
def test_survey_and_csv_are_alternatives(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(words)

    assert ended.value.code == 2
    assert "give either --survey with directories, or --csv with a file" in capsys.readouterr().err


def test_a_folder_that_does_not_exist_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert survey("--survey", "/gone", capsys=capsys) == (2, "", "ERROR: [/gone] is not a folder\n")
