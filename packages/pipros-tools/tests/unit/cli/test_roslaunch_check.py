"""`roslaunch-check`: reports all errors of a file at once, and writes a result file."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from pipros_tools.cli.roslaunch_check import main

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


def test_a_file_without_mistakes_passes(
    package: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(package, '<node name="n" pkg="robot" type="node.py"/>')

    result = tmp_path / "results/robot/rosunit-roslaunch_check_one_launch.xml"
    assert check(file, capsys=capsys) == (
        0,
        f"checking one.launch\n...writing test results to {result}\npassed\n",
        "",
    )
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
def test_a_mistake_is_reported_and_ends_with_1(
    package: Path, body: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
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
        "checking *.launch in directory .",
        "checking one.launch",
        "checking launch/two.launch",
    ]
    assert [node for node in ("a.py", "b.py", "c.py") if f"cannot find node [{node}]" in errors] == [
        "a.py",
        "b.py",
        "c.py",
    ]
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


def test_variables_of_the_environment_can_be_given(
    package: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROBOT", "before")
    file = write(package, '<node name="n" pkg="robot" type="$(env ROBOT).py"/>')

    assert check(file, "ROBOT=node", capsys=capsys)[0] == 0


@pytest.mark.parametrize("path", ["gone.launch", "/"])
def test_a_file_outside_of_a_package_is_refused(
    package: Path, path: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, errors = check(path, capsys=capsys)

    assert code == 1
    assert path in errors
