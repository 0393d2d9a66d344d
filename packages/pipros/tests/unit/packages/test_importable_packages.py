"""Packages whose Python modules can be imported."""

import os
import shutil
import sys
import zipfile
from pathlib import Path

import pytest

from pipros.packages import SHARE, ImportablePackages, cache_folder, folder_of_modules, has_only_messages
from pipros.packages.setup_modules import SetupModules, declared_module
from pipros.packages.zipped import unpacked


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


def test_modules_of_all_packages_on_the_path_are_found(tmp_path: Path, monkeypatch) -> None:
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


def test_modules_of_the_workspace_are_below_src_or_declared_by_setup_py(tmp_path: Path, monkeypatch) -> None:
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
def test_caches_are_below_ros_home(home: str, expected: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    monkeypatch.setenv("ROS_HOME", home)
    assert Path(cache_folder("x")) == Path(expected.format(home=tmp_path))


# Python modules that a `setup.py` names, found without running it.


HEAD = (
    "from setuptools import setup, find_packages\n"
    "from catkin_pkg.python_setup import generate_distutils_setup\n"
)


def package(folder: Path, setup: str, *files: str) -> Path:
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).touch()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "setup.py").write_text(setup)
    return folder


@pytest.mark.parametrize(("setup", "file"), [
    ("setup(packages=['lib'], package_dir={'': 'src'})", "src/lib"),
    ("setup(packages=['lib'], package_dir={'': 'python'})", "python/lib"),
    ("setup(packages=['lib'], package_dir={'lib': 'include/lib'})", "include/lib"),
    ("setup(packages=['lib', 'lib.sub'], package_dir={'lib': 'somewhere', 'lib.sub': 'x'})", "somewhere"),
    ("setup(packages=['lib'])", "lib"), ("setup(packages=('lib',), package_dir={'': './src/'})", "src/lib"),
    ("d = generate_distutils_setup(packages=['lib'], package_dir={'': 'src'})\nsetup(**d)", "src/lib"),
    ("setup(**generate_distutils_setup(packages=['lib'], package_dir={'': 'src'}))", "src/lib"),
    ("setup(packages=find_packages('src'), package_dir={'': 'src'})", "src/lib"),
    ("d = generate_distutils_setup()\nd['packages'] = ['robot', 'lib']\n"
        "d['package_dir'] = {'': 'src'}\nsetup(**d)", "src/lib"),
    ("d = {}\nd['py_modules'] = ['lib']\nd['package_dir'] = {'': 'src'}\nsetup(**d)", "src/lib.py"),
    ("d = {'packages': ['lib'], 'package_dir': {'lib': 'python'}}\nsetup(**d)", "python"),
    ("setup(name='x', py_modules=['lib'], package_dir={'': 'src'})", "src/lib.py"),
    ("if True:\n    setup(packages=['lib'], package_dir=dict())", "lib"),
])  # fmt: skip
def test_a_module_is_in_the_folder_of_its_setup(tmp_path: Path, setup: str, file: str) -> None:
    folder = package(tmp_path / "p", HEAD + setup, file if file.endswith(".py") else f"{file}/__init__.py")
    assert declared_module((HEAD + setup).encode(), str(folder), "lib") == str(folder / file)
    assert SetupModules().find("lib", [str(tmp_path / "nothing"), str(folder)]) == str(folder / file)


@pytest.mark.parametrize("setup", [
    "setup(packages=['other'], package_dir={'': 'src'})",
    "setup(packages=['lib'], package_dir={'': 'nowhere'})", "setup(py_modules=['lib'])", "setup(name='lib')",
    "setup(packages=['lib'", "lib = '\\d'\n\0", "",
])  # fmt: skip
def test_unnamed_and_missing_modules_are_not_found(tmp_path: Path, setup: str) -> None:
    folder = package(tmp_path / "p", setup, "src/lib/__init__.py")
    assert SetupModules().find("lib", [str(folder)]) is None


def test_a_setup_is_never_run(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    folder = package(tmp_path / "p", f"open({str(mark)!r}, 'w')\nsetup(packages=['lib'])", "lib/__init__.py")
    assert SetupModules().find("lib", [str(folder)]) == str(folder / "lib")
    assert not mark.exists()


def test_the_first_package_that_has_the_module_wins(tmp_path: Path) -> None:
    setup = "setup(packages=['lib'])"
    folders = [package(tmp_path / name, setup, "lib/__init__.py") for name in ("b", "a")]
    assert SetupModules().find("lib", map(str, folders)) == str(tmp_path / "b" / "lib")


def test_a_setup_py_that_is_not_a_file_or_too_long_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "folder" / "setup.py").mkdir(parents=True)
    long = package(tmp_path / "long", "setup(packages=['lib'])" + "#" * 300_000, "lib/__init__.py")
    assert SetupModules().find("lib", [str(tmp_path / "folder"), str(long)]) is None


# The shipped packages, if pipros is imported from a zip file.


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    file = tmp_path / "pipros.zip"
    with zipfile.ZipFile(file, "w") as content:
        content.writestr("pipros/share/robot/msg/Arm.msg", "int8 fingers\n")
        program = zipfile.ZipInfo("pipros/share/robot/nodes/talker")
        program.external_attr = 0o755 << 16
        content.writestr(program, "#!/usr/bin/env python3\n")
        content.writestr("pipros/other.py", "")
    return file


def test_each_state_of_a_zip_file_is_unpacked_once(archive: Path, tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    share = Path(unpacked(f"{archive}/pipros/share", cache))
    assert (share / "robot/msg/Arm.msg").read_text() == "int8 fingers\n"
    assert os.access(share / "robot/nodes/talker", os.X_OK)
    assert not (share.parent / "other.py").exists()
    (share / "robot/msg/Arm.msg").write_text("kept")
    assert unpacked(f"{archive}/pipros/share", cache) == str(share)
    assert (share / "robot/msg/Arm.msg").read_text() == "kept"

    with zipfile.ZipFile(archive, "a") as content:
        content.writestr("pipros/share/robot/msg/Hand.msg", "")
    assert Path(unpacked(f"{archive}/pipros/share", cache), "robot/msg/Hand.msg").is_file()
    assert len(os.listdir(cache)) == 2


def test_another_process_may_be_first(archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rename = os.rename

    def rename_too_late(old: str, new: str) -> None:
        shutil.copytree(old, new)
        (Path(new) / "first").touch()
        rename(old, new)

    monkeypatch.setattr(os, "rename", rename_too_late)
    share = Path(unpacked(f"{archive}/pipros/share", str(tmp_path / "cache")))
    assert (share.parents[1] / "first").is_file()
    assert len(os.listdir(tmp_path / "cache")) == 1


def test_a_cache_that_cannot_be_written_is_named(archive: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        unpacked(f"{archive}/pipros/share", str(tmp_path / "file" / "cache"))


def test_modules_of_shipped_packages_are_on_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = folder_of_modules("sensor_msgs", os.path.join(SHARE, "sensor_msgs"))
    assert found is not None
    assert os.path.isfile(os.path.join(found, "point_cloud2.py"))
    assert not has_only_messages(found)
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    assert folder_of_modules("sensor_msgs", os.path.join(SHARE, "sensor_msgs")) is None
    own = tmp_path / "ws" / "robot" / "src" / "robot"
    own.mkdir(parents=True)
    (own / "__init__.py").touch()
    assert folder_of_modules("robot", str(tmp_path / "ws" / "robot")) == str(own)
