import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rospkg import ResourceNotFound, RosPack

import roslib
from pipros.basics.errors import NotFound
from pipros.safe.xml import XmlError
from pipros_tools.bag.migration_plugins import installed_rules
from pipros_workspace.dependency_graph import CircularDependency, DependencyGraph
from pipros_workspace.index import PackageIndex
from roslib import packages

PACKAGES = {
    "top": "<exec_depend>left</exec_depend><exec_depend>right</exec_depend><exec_depend>boost</exec_depend>",
    "left": "<exec_depend>bottom</exec_depend><build_depend>right</build_depend>",
    "right": "<depend>bottom</depend><test_depend>rostest</test_depend>",
    "bottom": '<export><viewer plugin="${prefix}/p.xml"/></export>',
    "viewer": "",
    "plugins": "<exec_depend>viewer</exec_depend>"
    '<export><viewer plugin="${prefix}/q.xml" other="x"/></export>',
    "round": "<exec_depend>about</exec_depend>",
    "about": "<exec_depend>round</exec_depend>",
}


@pytest.fixture
def graph(tmp_path: Path) -> DependencyGraph:
    for name, content in PACKAGES.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.xml").write_text(f"<package><name>{name}</name>{content}</package>")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "package.xml").write_text("<package><name>broken</name>")
    return DependencyGraph(PackageIndex([tmp_path]))


@pytest.mark.parametrize(("name", "direct", "everything"), [
    ("top", ["left", "right"], ["bottom", "left", "right"]), ("left", ["bottom"], ["bottom"]),
    ("bottom", [], []),
])  # fmt: skip
def test_dependencies_at_run_time(
    graph: DependencyGraph, name: str, direct: list[str], everything: list[str]
) -> None:
    assert (graph.direct(name), graph.all(name)) == (direct, everything)


def test_names_in_a_manifest_are_listed_whatever_they_are(graph: DependencyGraph) -> None:
    assert (graph.named("top"), graph.named("left")) == (["boost", "left", "right"], ["bottom", "right"])
    assert graph.rosdeps("left") == ["bottom", "right"]
    assert graph.rosdeps("top") == ["boost", "bottom", "left", "right", "rostest"]
    assert graph.rosdeps("top", only_direct=True) == ["boost", "left", "right"]


def test_chains_are_all_paths(graph: DependencyGraph) -> None:
    assert list(graph.chains("top", "bottom")) == [["top", "left", "bottom"], ["top", "right", "bottom"]]
    assert list(graph.chains("bottom", "top")) == []
    assert list(graph.chains("round", "round")) == [["round", "about", "round"]]


def test_dependents_leave_broken_manifests_out(graph: DependencyGraph) -> None:
    assert graph.dependents("bottom", only_direct=True) == ["left", "right"]
    assert (graph.dependents("bottom"), graph.dependents("nowhere")) == (["left", "right", "top"], [])


def test_exports_name_the_package_and_its_folder(graph: DependencyGraph, tmp_path: Path) -> None:
    found = [(package.name, value) for package, value in graph.exporters("viewer", "plugin")]
    assert found == [("plugins", f"{tmp_path}/plugins/q.xml")]
    assert list(graph.exporters("viewer", "plugin", top="top")) == []
    assert [value for _, value in graph.exporters("viewer", "other", top="plugins")] == ["x"]


def test_a_circle_is_refused_with_its_packages(graph: DependencyGraph) -> None:
    with pytest.raises(CircularDependency, match="round -> about -> round"):
        graph.all("round")


def test_unknown_and_broken_packages_are_refused(graph: DependencyGraph) -> None:
    with pytest.raises(NotFound):
        graph.direct("nowhere")
    with pytest.raises(XmlError):
        graph.direct("broken")


@pytest.mark.parametrize("walk", [
    lambda index: installed_rules(index, print), lambda index: DependencyGraph(index).dependents("x")
])  # fmt: skip
def test_a_walk_over_all_packages_examines_their_folders_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, walk: Callable[[PackageIndex], object]
) -> None:
    """On Windows, asking for the time of a file takes as long as reading a line of it."""
    for root in ("first", "second"):
        for number in range(20):
            folder = tmp_path / root / f"{root}_{number}"
            folder.mkdir(parents=True)
            (folder / "package.xml").write_text(
                f"<package><name>{folder.name}</name><depend>absent</depend></package>"
            )
    asked: Counter[str] = Counter()
    stat = os.stat

    def counted(path: str, **options: Any) -> os.stat_result:
        asked[os.fspath(path)] += 1
        return stat(path, **options)

    monkeypatch.setattr(os, "stat", counted)
    walk(PackageIndex([tmp_path / "first", tmp_path / "second"]))
    monkeypatch.undo()
    assert asked[str(tmp_path / "first")] == 1
    assert max(asked.values()) <= 2, asked


# `roslib.packages`, with which old scripts find packages and their files.


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "src" / "old_robot"
    (folder / "scripts").mkdir(parents=True)
    (folder / "package.xml").write_text(
        "<package format='2'><name>old_robot</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='a@example.com'>a</maintainer><license>BSD</license></package>"
    )
    program = folder / "scripts" / "drive"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    (folder / "scripts" / "map.yaml").write_text("")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("CMAKE_PREFIX_PATH", raising=False)
    return folder


def test_packages_are_found(package: Path) -> None:
    assert packages.get_pkg_dir("old_robot") == str(package)
    assert packages.get_dir_pkg(str(package / "scripts")) == (str(package), "old_robot")
    assert packages.get_dir_pkg(str(package.parent)) == (None, None)


def test_a_missing_package_is_an_error_unless_it_is_not_required(package: Path) -> None:
    assert packages.get_pkg_dir("no_robot", required=False) is None
    assert packages.get_pkg_subdir("no_robot", "scripts", required=False) is None
    with pytest.raises(
        packages.InvalidROSPkgException, match="Cannot locate installation of package no_robot"
    ):
        packages.get_pkg_dir("no_robot")


def test_folders_are_made_when_they_are_required(package: Path) -> None:
    assert packages.get_pkg_subdir("old_robot", "scripts") == str(package / "scripts")
    assert packages.get_pkg_subdir("old_robot", "maps", required=False) is None
    assert packages.resource_file("old_robot", "maps", "hall.yaml") == str(package / "maps" / "hall.yaml")
    with pytest.raises(packages.InvalidROSPkgException):
        packages.resource_file("no_robot", "maps", "hall.yaml")
    assert packages.get_pkg_subdir("old_robot", "maps") == str(package / "maps")
    assert packages.resource_file("old_robot", "maps", "hall.yaml") == str(package / "maps" / "hall.yaml")
    with pytest.raises(packages.InvalidROSPkgException, match="cannot be created"):
        packages.get_pkg_subdir("old_robot", "package.xml/below")


@pytest.mark.needs("executable files")
def test_programs_and_files_are_found(package: Path) -> None:
    drive = str(package / "scripts" / "drive")
    assert packages.find_node("old_robot", "drive") == [drive]
    assert packages.find_node("old_robot", "map.yaml") == [], "no program"
    assert packages.find_resource("old_robot", "map.yaml") == [str(package / "scripts" / "map.yaml")]
    assert packages.find_resource("old_robot", "drive", lambda path: path != drive) == []
    with pytest.raises(ResourceNotFound, match="no_robot"):
        packages.find_node("no_robot", "drive")


def test_packages_are_found_in_the_given_folder(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", "")
    path = str(package.parent)
    assert packages.get_pkg_dir("old_robot", required=False) is None
    assert packages.get_pkg_dir("old_robot", ros_root="/", ros_package_path=path) == str(package)
    assert packages.get_pkg_subdir("old_robot", "scripts", env={"ROS_PACKAGE_PATH": path})
    packs = RosPack(ros_paths=[path])
    assert packages.find_node("old_robot", "drive", packs) == [str(package / "scripts" / "drive")]
    assert packages.find_resource("old_robot", "map.yaml", rospack=packs)
    assert packages.list_pkgs_by_path(path, ["another"]) == ["another", "old_robot"]


def test_load_manifest_succeeds_for_an_existing_package(package: Path) -> None:
    assert roslib.load_manifest is roslib.launcher.load_manifest
    roslib.load_manifest("old_robot")
    roslib.load_manifest("rospy")
    with pytest.raises(ResourceNotFound, match="no_robot"):
        roslib.load_manifest("no_robot")


def test_import_roslib_alone_gives_its_modules() -> None:
    asked = (
        "import roslib; roslib.packages.get_pkg_dir; roslib.launcher.load_manifest; "
        "roslib.exceptions.ROSLibException; "
        "import rosgraph; rosgraph.xmlrpc.XmlRpcNode; rosgraph.roslogging.RosStreamHandler; "
        "print(roslib.is_interactive(), roslib.set_interactive(True), roslib.is_interactive())"
    )
    ended = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=False)
    assert (ended.stdout, ended.stderr) == ("False None True\n", "")
