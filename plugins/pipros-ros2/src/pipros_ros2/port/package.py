"""Drafts of the files around nodes: package.xml, setup.py, setup.cfg, and the marker of ament."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_file
from pipros.safe.xml import parse
from pipros_ros2.port.rules import NOT_ON_PYPI
from pipros_workspace.manifest import read_manifest

_RENAMED: Final = {
    "actionlib": "rclpy",
    "catkin": "",
    "message_runtime": "",
    "roslaunch": "ros2launch",
    "roslib": "ament_index_python",
    "rospkg": "ament_index_python",
    "rospy": "rclpy",
    "tf": "tf2_ros",
}
_WITHOUT: Final = {
    "message_generation": "own messages need a wheel of `pipros wheel` for ROS 2, or ament_cmake and rosidl",
    "roscpp": "nodes in C++ need a package with ament_cmake and rclcpp",
    "rostest": "launch_testing starts nodes in tests",
    "dynamic_reconfigure": "rclpy's parameters can be set at run time",
}
_KNOWN: Final = {
    *("rclpy", "rmw_fastrtps_cpp", "std_msgs", "std_srvs", "sensor_msgs", "geometry_msgs", "nav_msgs"),
    *("diagnostic_msgs", "trajectory_msgs", "visualization_msgs"),  # what the extra `jazzy` installs
    *_RENAMED.values(),
    *NOT_ON_PYPI,
    *("launch_ros", "actionlib_msgs", "tf2_msgs"),
}
_SETUP: Final = """from setuptools import setup

setup(
    name={name!r},
    version={version!r},
    packages={packages!r},
    package_dir={{"": "src"}},
    scripts={scripts!r},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/{name}"]),
        ("share/{name}", ["package.xml"]),
        ("share/{name}/launch", {launches!r}),
{todos}    ],
    install_requires=["setuptools"],
)
"""


class InvalidPackageName(PiprosError):
    """The name of a package has other characters than letters, digits, `_` and `-`."""


def package_files(package: Path, scripts: Sequence[str], launches: Sequence[str]) -> dict[str, str]:
    """Return the texts of a package's files of the type ament_python, by name.

    Args:
        scripts: the drafted nodes, relative to the package.
        launches: the drafted launch files.

    Raises:
        InvalidPackageName: its name cannot be that of a package.
        XmlError: package.xml is invalid.
        OSError: it cannot be read.
    """
    manifest = read_manifest(package)
    name = manifest.name
    if not re.fullmatch(r"[A-Za-z][\w-]*", name):
        raise InvalidPackageName(f"{name!r} cannot be the name of a package")
    known = {"src", "include", "msg", "srv", "action", "test", *(Path(each).parts[0] for each in scripts)}
    known |= {Path(each).parts[0] for each in launches}
    folders = sorted(each.name for each in package.iterdir() if each.is_dir() and each.name not in known)
    setup = _SETUP.format(
        name=name,
        version=manifest.version,
        packages=[name] if (package / "src" / name / "__init__.py").is_file() else [],
        scripts=scripts,
        launches=launches,
        todos="".join(f"        # TODO: does the package need the files of {each!r}?\n" for each in folders),
    )
    place = f"$base/lib/{name}\n"
    return {
        "package.xml": _manifest(package, bool(launches)),
        "setup.py": setup,
        "setup.cfg": f"[develop]\nscript_dir={place}[install]\ninstall_scripts={place}",
        f"resource/{name}": "",
    }


def _manifest(package: Path, has_launches: bool) -> str:
    root = parse(read_file(package / "package.xml"), str(package / "package.xml"))
    lines = ['<?xml version="1.0"?>', '<package format="3">']
    for each in root.children:
        if "depend" not in each.tag and each.tag != "export":
            attributes = "".join(f" {key}={quoteattr(value)}" for key, value in each.attributes.items())
            lines.append(f"  <{each.tag}{attributes}>{escape(' '.join(each.text.split()))}</{each.tag}>")
    needs = {"launch_ros", "ros2launch"} if has_launches else set()
    for old in read_manifest(package).depends():
        if old in _WITHOUT:
            lines.append(f"  <!-- TODO: {old}: {_WITHOUT[old]} -->")
        else:
            needs.add(_RENAMED.get(old, old))
    for new in sorted(needs - {""}):
        if new not in _KNOWN and not new.startswith("python"):
            lines.append(f"  <!-- TODO: does ROS 2 have {new.replace('--', '-')} under this name? -->")
        lines.append(f"  <exec_depend>{escape(new)}</exec_depend>")
    lines += ["  <export>", "    <build_type>ament_python</build_type>", "  </export>", "</package>\n"]
    return "\n".join(lines)
