import io
import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from pipros_tools.cli import roslaunch
from pipros_tools.cli.roslaunch_check import main
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
    monkeypatch.chdir(package)
    return package / "x.launch"


@pytest.mark.parametrize(("given", "printed"), [
    (("--nodes", "talkers", "x.launch"), "/one\n/g/two\n/tt\n"), (("--files", "FILE"), "FILE\n"),
    (("--args", "one", "FILE"), 'A="1" FOLDER/talker a b __name:=one\n'),
    (("--find-node", "g/two", "x.launch"), "x.launch\n"),
    (("--ros-args", "FILE"), 'Optional Arguments:\n  x (default "1"): the x\n'),
    (("--dump-params", "FILE", "x:=hello"), "/a/b:\n- 1\n- 2\n/p: hello\n\n"),
])  # fmt: skip
def test_questions_about_a_file_are_answered(
    file: Path, capsys: pytest.CaptureFixture[str], given: tuple[str, ...], printed: str
) -> None:
    assert roslaunch.main([each.replace("FILE", str(file)) for each in given]) == 0
    expected = printed.replace("FILE", str(file)).replace("FOLDER", str(file.parent))
    assert capsys.readouterr().out == expected


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


@pytest.mark.parametrize(("given", "code", "printed"), [
    (("--args", "xx"), 1,
     "Cannot find node named [/xx] in [FILE].\nNode names are:\n * /one\n * /g/two\n * /tt\n"),
    (("--args", "/g/two"), 1, "Cannot locate node of type [nope]"),
    (("--find-node", "xx"), 0, "ERROR: cannot find node named [/xx]"),
])  # fmt: skip
def test_questions_about_nodes_that_cannot_be_answered_say_why(
    file: Path, capsys: pytest.CaptureFixture[str], given: tuple[str, ...], code: int, printed: str
) -> None:
    assert roslaunch.main([*given, str(file)]) == code
    assert printed.replace("FILE", str(file)) in capsys.readouterr().err


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


def test_a_launch_file_comes_from_standard_input(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO('<launch><node pkg="p" type="t" name="n"/></launch>'))
    assert (roslaunch.main(["--nodes", "-"]), capsys.readouterr().out) == (0, "/n\n")


@pytest.mark.parametrize("option", ["--nodes", "--files", "--ros-args", "--dry-run"])
def test_a_broken_file_is_an_error_for_every_inspection(option: str, tmp_path: Path, capsys) -> None:
    (tmp_path / "bad.launch").write_text("<launch><foo")
    assert roslaunch.main([option, str(tmp_path / "bad.launch")]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("Invalid roslaunch XML syntax: unclosed token")


def test_dump_params_prints_nothing_for_a_broken_file(tmp_path: Path, capsys) -> None:
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
    (["--core", "f"], "when launching core"), (["--nodes", "--args=x", "f"], "only one of [--nodes"),
])  # fmt: skip
def test_a_wrong_command_line_ends_with_2(words: list[str], complaint: str, capsys) -> None:
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


# `roslaunch-check`: reports all errors of a file at once, and writes a result file.


MANIFEST = """<package format="2"><name>{name}</name><exec_depend>std_msgs</exec_depend>{more}</package>"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("robot", "arm"):
        folder = tmp_path / "src" / name
        folder.mkdir(parents=True)
        (folder / "package.xml").write_text(MANIFEST.format(name=name, more=""))
        (folder / "node.py").write_text("#!/usr/bin/env python3\n")
        (folder / "node.py").chmod(0o755)
    (tmp_path / "src/robot/plain.py").write_text("")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    monkeypatch.setenv("ROS_TEST_RESULTS_DIR", str(tmp_path / "results"))
    monkeypatch.chdir(tmp_path / "src/robot")
    return tmp_path / "src/robot"


def write(package: Path, body: str, name: str = "one.launch") -> str:
    file = package / name
    file.parent.mkdir(exist_ok=True)
    file.write_text(f"<launch>\n{body}\n</launch>")
    return name


def check(*words: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    code = main(words)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_a_file_without_mistakes_passes(package: Path, tmp_path: Path, capsys) -> None:
    file = write(package, '<node name="n" pkg="robot" type="node.py"/>')

    result = tmp_path / "results/robot/rosunit-roslaunch_check_one_launch.xml"
    assert check(file, capsys=capsys) == (
        0, f"checking one.launch\n...writing test results to {result}\npassed\n", ""
    )  # fmt: skip
    (case,) = ElementTree.parse(result).getroot().iter("testcase")  # noqa: S314
    assert (case.attrib["classname"], case.attrib["name"]) == ("roslaunch.RoslaunchCheck", "robot_one_launch")


@pytest.mark.parametrize(("body", "message"), [
    ("<node", "Invalid roslaunch XML syntax"), ('<include file="$(find robot)/gone.launch"/>', "gone.launch"),
    ('<include file="$(find gone)/gone.launch"/>', "gone"),
    ('<node name="n" pkg="gone" type="node.py"/>', "cannot find package [gone] for node [node.py]"),
    ('<node name="n" pkg="robot" type="gone.py"/>', "cannot find node [gone.py] in package [robot]"),
    pytest.param(
        '<node name="n" pkg="robot" type="plain.py"/>',
        "plain.py is not executable",
        marks=pytest.mark.needs("executable files"),
    ),
    ('<node name="n" pkg="arm" type="node.py"/>', "Missing package dependencies: robot/package.xml: arm"),
    ('<nod name="n"/>', "ROSLaunch config error: unrecognized tag nod"),
    ('<arg name="level"/>', "No value for arg [level]"),
    ('<test test-name="t" pkg="robot" type="gone.py"/>', "cannot find node [gone.py] in package [robot]"),
])  # fmt: skip
def test_a_mistake_is_reported_and_ends_with_1(package: Path, body: str, message: str, capsys) -> None:
    code, _, errors = check(write(package, body), capsys=capsys)

    assert code == 1
    assert errors.startswith("FAILURE:\n[one.launch]:\n\t")
    assert message in errors


def test_all_launch_files_of_a_folder_are_checked_and_all_mistakes_reported(
    package: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(package, '<node name="n" pkg="robot" type="a.py"/><node name="m" pkg="robot" type="b.py"/>')
    write(package, '<node name="n" pkg="robot" type="c.py"/>', "launch/two.launch")
    write(package, "<node", ".hidden/three.launch")

    code, output, errors = check(".", capsys=capsys)

    assert code == 1
    assert output.splitlines()[:3] == [
        "checking *.launch in directory .", "checking one.launch", "checking launch/two.launch"
    ]  # fmt: skip
    assert [node for node in ("a.py", "b.py", "c.py") if f"cannot find node [{node}]" in errors] == [
        "a.py", "b.py", "c.py"
    ]  # fmt: skip
    result = tmp_path / "results/robot/rosunit-roslaunch_check__pkg.xml"
    assert ElementTree.parse(result).getroot().attrib["failures"] == "1"  # noqa: S314


def test_options_make_it_milder(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    unset = write(package, '<arg name="level"/><param name="p" value="$(arg level)"/>')
    assert check("-i", unset, capsys=capsys)[0] == 0

    (package / "package.xml").write_text(MANIFEST.format(name="robot", more="<test_depend>arm</test_depend>"))
    needs_arm = write(package, '<node name="n" pkg="arm" type="node.py"/>')
    assert check(needs_arm, capsys=capsys)[0] == 1
    assert check("-t", "-o", "here.xml", needs_arm, capsys=capsys)[0] == 0
    assert Path("here.xml").exists()


def test_variables_of_the_environment_can_be_given(package: Path, monkeypatch, capsys) -> None:
    monkeypatch.setenv("ROBOT", "before")
    file = write(package, '<node name="n" pkg="robot" type="$(env ROBOT).py"/>')

    assert check(file, "ROBOT=node", capsys=capsys)[0] == 0


@pytest.mark.parametrize("path", ["gone.launch", "/"])
def test_a_file_outside_of_a_package_is_refused(package: Path, path: str, capsys) -> None:
    code, _, errors = check(path, capsys=capsys)

    assert code == 1
    assert path in errors


# `roslaunch-check --survey` and `--csv`: who provides the programs that launch files name.


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


def test_the_survey_of_a_tree_says_who_provides_each_program(tree: Path, capsys) -> None:
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


def test_a_csv_file_gives_the_figures_with_and_without_packages(tmp_path: Path, capsys) -> None:
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
def test_a_malformed_csv_file_is_an_error(tmp_path, content: bytes | None, message: str, capsys) -> None:
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
