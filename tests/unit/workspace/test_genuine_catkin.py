"""What goes to genuine catkin beside the packages of the workspace itself."""

from __future__ import annotations

from pathlib import Path

from pipros.workspace.genuine_catkin import shipped_packages
from pipros.workspace.index import SHARED_PACKAGES
from pipros.workspace.layout import SourcePackage, read_source_space

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


def test_what_genuine_ros_lacks_is_taken_from_pipros_with_all_that_it_needs(tmp_path: Path) -> None:
    prefix = prefix_with(tmp_path / "opt", "std_msgs", "geometry_msgs", "trajectory_msgs")

    shipped = shipped_packages(arm(tmp_path / "src"), [tmp_path / "other", prefix])

    assert {package.name for package in shipped} == {"control_msgs", "actionlib_msgs"}
    assert all(package.folder == SHARED_PACKAGES / package.name for package in shipped)


def test_what_genuine_ros_or_the_workspace_has_is_left_to_them(tmp_path: Path) -> None:
    packages = arm(tmp_path / "src")

    assert shipped_packages(packages, [prefix_with(tmp_path / "opt", "control_msgs")]) == []

    own = SourcePackage("control_msgs", tmp_path / "src" / "control_msgs", packages[0].manifest)
    assert shipped_packages([*packages, own], []) == []
