"""Which packages genuine catkin gets besides those of the workspace itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.workspace import genuine_catkin
from pipros.workspace.build_options import BuildOptions
from pipros.workspace.genuine_catkin import (
    MissingTools,
    NativeBuildFailed,
    NativeTools,
    find_tools,
    has_tools,
    shipped_packages,
)
from pipros.workspace.index import SHARED_PACKAGES
from pipros.workspace.layout import Layout, SourcePackage, read_source_space

MANIFEST = """<package format="2"><name>arm</name><version>1.0.0</version><description>d</description>
<maintainer email="m@example.org">m</maintainer><license>none</license>
<depend>control_msgs</depend><depend>roscpp</depend><depend>no_such_package</depend></package>"""


def arm(source: Path) -> list[SourcePackage]:
    folder = source / "arm"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(MANIFEST)
    return read_source_space(source, {}).packages


def prefix_with(folder: Path, *packages: str) -> Path:
    """A folder in which CMake finds packages, as below /opt/ros/noetic."""
    for package in packages:
        config = folder / "share" / package / "cmake" / f"{package}Config.cmake"
        config.parent.mkdir(parents=True)
        config.touch()
    return folder


def test_packages_that_genuine_ros_does_not_have_come_from_pipros_with_their_dependencies(
    tmp_path: Path,
) -> None:
    prefix = prefix_with(tmp_path / "opt", "std_msgs", "geometry_msgs", "trajectory_msgs")

    shipped = shipped_packages(arm(tmp_path / "src"), [tmp_path / "other", prefix])

    assert {package.name for package in shipped} == {"control_msgs", "actionlib_msgs"}
    assert all(package.folder == SHARED_PACKAGES / package.name for package in shipped)


def test_what_genuine_ros_or_the_workspace_has_is_left_to_them(tmp_path: Path) -> None:
    packages = arm(tmp_path / "src")

    assert shipped_packages(packages, [prefix_with(tmp_path / "opt", "control_msgs")]) == []

    own = SourcePackage("control_msgs", tmp_path / "src" / "control_msgs", packages[0].manifest)
    assert shipped_packages([*packages, own], []) == []


@pytest.mark.parametrize("folder", ["share/control_msgs/cmake", "lib/cmake/control_msgs",
                                    "lib/aarch64-linux-gnu/cmake/control_msgs"])  # fmt: skip
def test_an_installed_package_is_found_wherever_cmake_finds_it(tmp_path: Path, folder: str) -> None:
    config = tmp_path / "usr" / folder / "control_msgsConfig.cmake"
    config.parent.mkdir(parents=True)
    config.touch()

    assert shipped_packages(arm(tmp_path / "src"), [tmp_path / "usr"]) == []


def programs(folder: Path, *names: str, code: int = 0) -> dict[str, str]:
    """An environment in which only these programs exist; they end with `code`."""
    folder.mkdir()
    for name in names:
        file = folder / name
        file.write_text(f"#!/bin/sh\nexit {code}\n")
        file.chmod(0o755)
    return {"PATH": str(folder)}


@pytest.mark.parametrize(
    ("names", "advice"),
    [
        ((), "apt install cmake g++ catkin ros-core-dev"),
        (("cmake", "make"), "apt install make g++"),
        (("cmake", "c++"), "apt install make g++"),
        (("cmake", "make", "c++"), "apt install catkin ros-core-dev"),
    ],
)
def test_what_is_missing_is_named_with_the_packages_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, names: tuple[str, ...], advice: str
) -> None:
    monkeypatch.setattr(genuine_catkin, "_PREFIXES", ())
    environment = programs(tmp_path / "bin", *names)

    assert not has_tools(environment)
    with pytest.raises(MissingTools) as error:
        find_tools(environment)
    assert advice in str(error.value)


def test_the_tools_of_an_overlay_are_found_by_its_prefix(tmp_path: Path) -> None:
    environment = programs(tmp_path / "bin", "cmake", "make", "c++")
    toplevel = tmp_path / "opt" / "share" / "catkin" / "cmake" / "toplevel.cmake"
    toplevel.parent.mkdir(parents=True)
    toplevel.touch()
    environment["CMAKE_PREFIX_PATH"] = f"{tmp_path / 'opt'}"

    tools = find_tools(environment)

    assert (tools.prefix, tools.toplevel) == (tmp_path / "opt", toplevel)


def test_a_tool_that_fails_is_named(tmp_path: Path) -> None:
    programs(tmp_path / "bin", "cmake", code=3)
    layout = Layout(tmp_path, *(tmp_path / name for name in ("src", "build", "devel", "install")))
    tools = NativeTools(str(tmp_path / "bin" / "cmake"), tmp_path / "opt")

    with pytest.raises(NativeBuildFailed, match=r"cmake .* failed; the reason is printed above"):
        genuine_catkin.build(tools, arm(tmp_path / "src"), layout, BuildOptions(), lambda _line: None)


def test_catkin_tools_in_the_environment_of_pipros_are_told_what_to_do() -> None:
    """CMake code of genuine catkin imports this function from the `catkin` of the environment."""
    from catkin.environment_cache import generate_environment_script

    with pytest.raises(SystemExit, match="catkin build --cmake-args -DPYTHON_EXECUTABLE=/usr/bin/python3"):
        generate_environment_script("/ws/devel/env.sh")
