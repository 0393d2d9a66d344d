import os
from pathlib import Path

import pytest

from pipros.basics.env import Environment
from pipros.packages import SHARE, ImportablePackages
from pipros.packages.system_packages import child_package_path
from pipros_tools.cli.complete.candidates import candidates
from pipros_tools.cli.rosrun import main as rosrun
from pipros_tools.health.wtf.launch import roslaunch_missing_node_check, roslaunch_missing_pkgs_check
from pipros_tools.health.wtf.subject import Subject
from pipros_tools.launch.check import mistakes
from pipros_tools.launch.command import CannotLaunch, CommandMaker
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import LaunchNode
from pipros_tools.launch.xml import load
from pipros_workspace.executables import find_executables, list_executables, package_of_programs
from pipros_workspace.index import SHARED_PACKAGES, PackageIndex
from pipros_workspace.program_start import environment_of
from tests.support.debian_system import OTHER_PROGRAM, DebianSystem, make_debian


@pytest.fixture
def debian(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> DebianSystem:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    return make_debian(tmp_path, monkeypatch)


def index_of(*folders: Path) -> PackageIndex:
    return PackageIndex.from_environment(Environment(package_path=folders))


def test_a_package_of_debian_is_found_without_a_variable(debian: DebianSystem) -> None:
    folder = debian.add_manifest("image_publisher")
    assert index_of().find("image_publisher").path == folder
    assert ImportablePackages().find("image_publisher") == str(folder)
    assert "image_publisher" in [package.name for package in index_of()]


def test_a_package_below_another_name_is_not_found(debian: DebianSystem) -> None:
    debian.add_manifest("php_thing").joinpath("package.xml").write_text(
        "<package><name>Thing</name></package>"
    )
    debian.add_manifest("deep").joinpath("sub").mkdir()
    (debian.share / "deep" / "sub" / "package.xml").write_text("<package><name>sub</name></package>")
    for name in ("php_thing", "sub", "..", "deep/sub", "", "nul\0", "x" * 300):
        assert index_of().get(name) is None
        assert ImportablePackages().find(name) is None


@pytest.mark.parametrize("ending", ["", "/"])
def test_packages_of_pipros_win_even_if_the_path_lists_debians_folder(
    debian: DebianSystem, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    debian.add_manifest("topic_tools")
    folder = debian.add_manifest("image_publisher")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{debian.share}{ending}")
    index = PackageIndex.from_environment()
    assert index.find("topic_tools").path == SHARED_PACKAGES / "topic_tools"
    assert find_executables(index.find("topic_tools"), "throttle").runnable
    assert index.find("image_publisher").path == folder
    assert ImportablePackages().find("topic_tools") == os.path.join(SHARE, "topic_tools")
    assert "lists no workspace" in index.advice


def test_a_workspace_wins_over_debian(debian: DebianSystem, tmp_path: Path) -> None:
    debian.add_manifest("image_publisher")
    own = tmp_path / "ws" / "image_publisher"
    own.mkdir(parents=True)
    (own / "package.xml").write_text("<name>image_publisher</name>")
    index = index_of(tmp_path / "ws")
    assert index.find("image_publisher").path == own
    assert index.duplicates() == {"image_publisher": [own, debian.share / "image_publisher"]}


def test_only_real_duplicates_are_listed(debian: DebianSystem) -> None:
    debian.add_manifest("topic_tools")
    assert index_of().duplicates() == {}


def test_a_program_that_the_winner_lacks_is_debians(debian: DebianSystem) -> None:
    program = debian.add_program("nodelet", "declared_nodelets")
    package = index_of().find("nodelet")
    assert package.path == SHARED_PACKAGES / "nodelet"
    assert find_executables(package, "declared_nodelets").runnable == (program,)
    assert "declared_nodelets" in list_executables(package)
    assert find_executables(package, "../nodelet/declared_nodelets").runnable == ()


def test_a_program_that_the_winner_has_is_the_winners(debian: DebianSystem) -> None:
    debian.add_program("topic_tools", "throttle")
    (program,) = find_executables(index_of().find("topic_tools"), "throttle").runnable
    assert program.is_relative_to(SHARED_PACKAGES)


def test_programs_without_a_manifest_make_a_package_of_programs(debian: DebianSystem) -> None:
    program = debian.add_program("image_rotate", "image_rotate")
    assert index_of().get("image_rotate") is None
    package = package_of_programs(index_of(), "image_rotate")
    assert find_executables(package, "image_rotate").runnable == (program,)
    assert "image_rotate" in list(candidates(["rosrun", ""]))
    assert list(candidates(["rosrun", "image_rotate", ""])) == ["image_rotate"]
    assert "image_rotate" not in list(candidates(["roscd", ""]))


def test_folders_of_other_software_are_not_packages(debian: DebianSystem, capsys) -> None:
    debian.add_program("apt", "apt-helper", OTHER_PROGRAM)
    assert rosrun(["apt", "apt-helper"]) == 2
    assert "package 'apt' not found" in capsys.readouterr().err
    assert "apt" not in list(candidates(["rosrun", ""]))
    assert list(candidates(["rosrun", "apt", ""])) == []


def test_roslaunch_and_its_checks_find_the_programs(debian: DebianSystem, tmp_path: Path) -> None:
    rotate = debian.add_program("image_rotate", "image_rotate")
    debian.add_manifest("image_publisher")
    proc = debian.add_program("image_publisher", "image_publisher")
    maker = CommandMaker(index_of(), {"PATH": ""}, tmp_path)
    for name, program in (("image_rotate", rotate), ("image_publisher", proc)):
        command = maker.make(LaunchNode(name, name, "n"), "http://localhost:1")
        assert (command.argv[0], command.environment["ROS_PACKAGE_PATH"]) == (str(program), str(debian.share))
    with pytest.raises(CannotLaunch, match=r"Cannot locate node of type \[rotate\] in package"):
        maker.make(LaunchNode("image_rotate", "rotate", "n"), "http://localhost:1")

    file = tmp_path / "a.launch"
    file.write_text(
        '<launch><node name="a" pkg="image_rotate" type="image_rotate"/>'
        '<node name="b" pkg="image_rotate" type="nope"/><node name="c" pkg="nope" type="nope"/></launch>'
    )
    assert [text.partition(" (")[0] for text in mistakes(file, index_of())] == [
        "cannot find node [nope] in package [image_rotate]",
        "cannot find package [nope] for node [nope]",
    ]
    launch = load([str(file)], context=LoadContext.of_process(index_of()))
    subject = Subject({}, index_of(), launch=launch)
    assert roslaunch_missing_pkgs_check(subject) == ["nope"]
    assert roslaunch_missing_node_check(subject) == ["node [nope] in package [image_rotate]"]


def test_compiled_programs_find_debians_plugins_before_packages_of_pipros(debian, tmp_path) -> None:
    program, script = debian.add_program("a", "node"), debian.add_program("a", "script", b"#!/bin/sh\n")
    variables = {"PATH": "", "ROS_PACKAGE_PATH": f"/ws/src:{SHARE}"}
    assert environment_of(program, variables)["ROS_PACKAGE_PATH"] == f"/ws/src:{SHARE}"  # no package there
    debian.add_manifest("image_publisher")
    assert environment_of(program, variables)["ROS_PACKAGE_PATH"] == f"/ws/src:{debian.share}:{SHARE}"
    assert environment_of(script, variables)["ROS_PACKAGE_PATH"] == f"/ws/src:{SHARE}"
    assert child_package_path("", [SHARE]) == str(debian.share)
    assert child_package_path(f"{SHARE}:{debian.share}", [SHARE]).startswith(f"{debian.share}:{SHARE}")
    assert child_package_path(f"{debian.share}/:/x", [SHARE]) == f"{debian.share}/:/x"
