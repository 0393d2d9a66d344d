import shutil
from pathlib import Path

import pytest

from pipros_tools.cli import check_urdf, urdf_to_graphviz

# The outputs are those of urdfdom 3.0.1 for the same file.
URDF = """
<robot name="test_robot">
  <link name="link1"/><link name="k9"/><link name="link3"/><link name="link4"/>
  <joint name="z1" type="continuous">
    <parent link="link1"/><child link="k9"/><origin xyz="5 3 0" rpy="0 0 0"/><axis xyz="-0.9 0.15 0"/>
  </joint>
  <joint name="joint2" type="continuous">
    <parent link="link1"/><child link="link3"/><origin xyz="-2 5 0" rpy="0 0 1.57"/><axis xyz="-0.7 0.7 0"/>
  </joint>
  <joint name="joint3" type="fixed">
    <parent link="link3"/><child link="link4"/><origin xyz="5 0 0" rpy="0 0 -1.57"/>
  </joint>
</robot>
"""
TREE = """\
robot name is: test_robot
---------- Successfully Parsed XML ---------------
root Link: link1 has 2 child(ren)
    child(1):  link3
        child(1):  link4
    child(2):  k9
"""
DRAWING = r"""digraph G {
node [shape=box];
"link1" [label="link1"];
"link3" [label="link3"];
"link4" [label="link4"];
"k9" [label="k9"];
node [shape=ellipse, color=blue, fontcolor=blue];
"link1" -> "joint2" [label="xyz: -2 5 0 \nrpy: 0 -0 1.57"]
"joint2" -> "link3"
"link3" -> "joint3" [label="xyz: 5 0 0 \nrpy: 0 0 -1.57"]
"joint3" -> "link4"
"link1" -> "z1" [label="xyz: 5 3 0 \nrpy: 0 -0 0"]
"z1" -> "k9"
}
"""


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "robot.urdf"
    path.write_text(URDF)
    return path


def test_check_urdf_prints_the_tree_of_links(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (check_urdf.main([str(robot)]), capsys.readouterr().out) == (0, TREE)


@pytest.mark.parametrize(("text", "reason"), [
    ('<robot name="x"><link name="a"/><link name="b"/></robot>', "must have no parent, got a and b"),
    ("<robot", "not XML"), ('<robot><link name="a"/></robot>', "must have a name attribute"),
    ("\xff", "can't decode"),
])  # fmt: skip
def test_an_invalid_description_is_named_in_one_line(robot: Path, capsys, text: str, reason: str) -> None:
    robot.write_text(text, encoding="latin-1")
    for program in (check_urdf.main, urdf_to_graphviz.main):
        assert program([str(robot)]) == 255
        error = capsys.readouterr().err
        assert error.startswith(f"ERROR: {robot}: ")
        assert reason in error
    assert list(robot.parent.glob("*.gv")) == []


def test_a_missing_file_and_a_missing_argument_are_errors(robot: Path, capsys) -> None:
    assert check_urdf.main(["missing.urdf"]) == 255
    assert capsys.readouterr().err == "ERROR: cannot read missing.urdf: No such file or directory\n"
    assert (check_urdf.main([]), capsys.readouterr().err) == (255, "Usage: check_urdf FILE\n")
    assert urdf_to_graphviz.main([]) == 255
    assert "Usage: urdf_to_graphviz FILE" in capsys.readouterr().err


@pytest.mark.needs("first lines")
def test_urdf_to_graphviz_writes_the_drawing_of_urdfdom(robot: Path, capsys, monkeypatch) -> None:
    dot = robot.parent / "dot"
    dot.write_text('#!/bin/sh\ncat "$2"\n')
    dot.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda _: str(dot))
    assert urdf_to_graphviz.main([str(robot)]) == 0
    assert capsys.readouterr().out == "Created file test_robot.gv\nCreated file test_robot.pdf\n"
    assert Path("test_robot.gv").read_text() == Path("test_robot.pdf").read_text() == DRAWING
    assert urdf_to_graphviz.graphiz([str(robot), "mine"]) == 0
    assert "urdf_to_graphiz is deprecated" in capsys.readouterr().err
    assert Path("mine.gv").read_text() == DRAWING


def test_without_graphviz_pipros_draws_the_robot(robot: Path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    assert urdf_to_graphviz.main([str(robot)]) == 0
    assert capsys.readouterr().out == "Created file test_robot.gv\nCreated file test_robot.pdf\n"
    assert Path("test_robot.pdf").read_bytes().startswith(b"%PDF-")


def test_the_name_of_a_robot_names_no_file_elsewhere(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot.write_text('<robot name="../outside"><link name="a"/></robot>')
    assert urdf_to_graphviz.main([str(robot)]) == 255
    assert "'../outside', cannot be used as a file name" in capsys.readouterr().err
    assert not Path("../outside.gv").exists()


def chain(count: int) -> str:
    links = "".join(f"<link name='l{number}'/>" for number in range(count))
    joints = "".join(
        f"<joint name='j{number}' type='fixed'><parent link='l{number}'/><child link='l{number + 1}'/>"
        "</joint>"
        for number in range(count - 1)
    )
    return f"<robot name='long'>{links}{joints}</robot>"


def test_the_tree_of_a_long_chain_stays_short(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The indentation of 20,000 nested links alone had 800 MB."""
    file = tmp_path / "long.urdf"
    file.write_text(chain(3000))
    assert check_urdf.main([str(file)]) == 0
    lines = capsys.readouterr().out.splitlines()[3:]
    assert [line.strip() for line in lines] == [f"child(1):  l{number}" for number in range(1, 3000)]
    assert lines[99].startswith("    " * 100 + "child")
    assert max(map(len, lines)) < 1000


def test_graphviz_does_not_draw_robots_for_which_it_needs_minutes(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    dot = tmp_path / "dot"
    dot.write_text("#!/bin/sh\nexit 1\n")
    dot.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda _: str(dot))
    for count, code in ((3, 255), (1200, 0)):
        (tmp_path / "robot.urdf").write_text(chain(count))
        assert urdf_to_graphviz.main(["robot.urdf", f"chain{count}"]) == code
    assert (tmp_path / "chain1200.pdf").read_bytes().startswith(b"%PDF")
