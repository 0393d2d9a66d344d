"""`roslib.packages`, with which old scripts find packages and their files."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from rospkg import ResourceNotFound, RosPack

import roslib
from roslib import packages


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
