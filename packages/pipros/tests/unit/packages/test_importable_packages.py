from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros.packages import SHARE, ImportablePackages, cache_folder


def add(folder: Path, name: str) -> Path:
    (folder / name).mkdir(parents=True)
    (folder / name / "package.xml").write_text(f"<name>{name}</name>")
    return folder / name


def test_the_path_wins_over_packages_of_pipros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = add(tmp_path / "src", "std_msgs")
    packages = ImportablePackages()
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    assert packages.find("std_msgs") == os.path.join(SHARE, "std_msgs")
    monkeypatch.setenv(
        "ROS_PACKAGE_PATH", f"{tmp_path / 'nowhere'}{os.pathsep}{os.pathsep}{tmp_path / 'src'}"
    )
    assert packages.find("std_msgs") == str(own)
    assert packages.find("nav_msgs") == os.path.join(SHARE, "nav_msgs")


@pytest.mark.parametrize("name", ["no_such_package", "", "..", "std_msgs/msg", "."])
def test_other_names_are_not_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    assert ImportablePackages().find(name) is None
    assert ImportablePackages().find_module(name, None) is None


def test_modules_of_all_packages_on_the_path_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    driver = add(tmp_path / "src", "robot_driver")
    (driver / "setup.py").write_text("setup(packages=['robot_lib'], package_dir={'': 'py'})")
    (driver / "py" / "robot_lib").mkdir(parents=True)
    (driver / "py" / "robot_lib" / "__init__.py").touch()
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    packages = ImportablePackages()
    assert packages.find_module("robot_lib", None) == str(driver / "py" / "robot_lib")
    assert packages.find_module("robot_lib", str(tmp_path)) is None
    assert packages.find_module("other", None) is None


def test_only_packages_of_the_workspace_hide_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = add(tmp_path / "src", "robot")
    packages = ImportablePackages()
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    assert packages.find_hiding("robot") is None
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    assert packages.find_hiding("robot") == str(robot)
    assert packages.find_hiding("std_msgs") is None


def test_modules_of_the_workspace_are_below_src_or_declared_by_setup_py(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, arm = add(tmp_path / "src", "robot"), add(tmp_path / "src", "arm")
    for module in (robot / "src" / "robot", arm / "py" / "arm"):
        module.mkdir(parents=True)
        (module / "__init__.py").touch()
    (arm / "setup.py").write_text("setup(packages=['arm'], package_dir={'': 'py'})")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    packages = ImportablePackages()

    assert packages.find_in_workspace("robot", "robot") == str(robot / "src" / "robot")
    assert packages.find_in_workspace("arm", "arm") == str(arm / "py" / "arm")
    assert packages.find_in_workspace("other", "robot") is None
    assert packages.find_in_workspace("std_msgs", "std_msgs") is None


@pytest.mark.parametrize(
    ("home", "expected"),
    [("/somewhere", "/somewhere/pipros/x"), ("~/r", "{home}/r/pipros/x"), ("", "{home}/.ros/pipros/x")],
)
def test_caches_are_below_ros_home(
    home: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    monkeypatch.setenv("ROS_HOME", home)
    assert Path(cache_folder("x")) == Path(expected.format(home=tmp_path))
