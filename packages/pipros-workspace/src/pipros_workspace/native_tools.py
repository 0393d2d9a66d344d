"""The tools that build compiled code: CMake, a compiler and genuine catkin. Find them and their packages."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.env import DISTRIBUTION
from pipros.basics.errors import PiprosError
from pipros_workspace.shipped_packages import is_below

_PREFIXES = ("/opt/ros/noetic", "/opt/ros/one", "/opt/ros/melodic", "/usr")
"""Prefixes at which genuine ROS may be installed, in addition to those in the environment."""
_TOPLEVEL = "share/catkin/cmake/toplevel.cmake"
PYTHON = "/usr/bin/python3"
# The ROS_DISTRO of Debian's packages. If the variable has another value, one of their environment hooks
# prints a line, which catkin would evaluate as Python.
_DEBIAN = "Debian"


class MissingTools(PiprosError):
    """CMake, a compiler or genuine catkin is not installed. The message says what to install."""


@dataclass(frozen=True, slots=True)
class NativeTools:
    """The locations of CMake and genuine catkin.

    `prefix` is catkin's prefix, such as `/opt/ros/noetic` or `/usr`.
    """

    cmake: str
    prefix: Path

    @property
    def toplevel(self) -> Path:
        return self.prefix / _TOPLEVEL


def find_tools(variables: Mapping[str, str], prefixes: Sequence[str] = _PREFIXES) -> NativeTools:
    """Find CMake and genuine catkin, and check that a compiler is installed.

    Args:
        variables: the environment; only `PATH` and `CMAKE_PREFIX_PATH` are used.

    Raises:
        MissingTools: a tool is missing; the message says what to install.
    """
    path = variables.get("PATH")
    cmake = shutil.which("cmake", path=path)
    if cmake is None:
        raise MissingTools(
            "cmake is not in PATH. Install CMake, a C++ compiler and genuine catkin "
            "(Debian: apt install cmake make g++ catkin libroscpp-dev ros-message-generation), "
            "or put a file named CATKIN_IGNORE into the package's folder"
        )
    if shutil.which("make", path=path) is None or shutil.which("c++", path=path) is None:
        raise MissingTools("make or c++ is not in PATH. Install them (Debian: apt install make g++)")
    toplevel = find_toplevel(variables, prefixes)
    if toplevel is not None:
        return NativeTools(cmake, toplevel.parents[3])
    raise MissingTools(
        "genuine catkin is not installed. Install it (Debian: apt install catkin libroscpp-dev "
        "ros-message-generation), or put a file named CATKIN_IGNORE into the package's folder"
    )


def has_tools(variables: Mapping[str, str], prefixes: Sequence[str] = _PREFIXES) -> bool:
    """Return whether all tools needed to build C++ packages are installed."""
    try:
        find_tools(variables, prefixes)
    except MissingTools:
        return False
    return True


def find_toplevel(
    variables: Mapping[str, str] | None = None, prefixes: Sequence[str] = _PREFIXES
) -> Path | None:
    """Return the path of genuine catkin's `toplevel.cmake`, or None if catkin is not installed.

    `catkin_init_workspace` links the top-level `CMakeLists.txt` of a workspace to this file.
    """
    prefix_path = (os.environ if variables is None else variables).get("CMAKE_PREFIX_PATH", "")
    for prefix in (*filter(None, prefix_path.split(os.pathsep)), *prefixes):
        if Path(prefix, _TOPLEVEL).is_file():
            return Path(prefix, _TOPLEVEL)
    return None


def has_package(tools: NativeTools, name: str, variables: Mapping[str, str]) -> bool:
    """Return whether a package is installed with genuine ROS or is in a sourced workspace."""
    prefixes = native_environment(tools, variables)["CMAKE_PREFIX_PATH"].split(os.pathsep)
    return any(is_below(name, Path(prefix)) for prefix in prefixes)


def is_installed(name: str, variables: Mapping[str, str]) -> bool:
    """Return whether CMake finds a package in genuine ROS or in a sourced workspace."""
    entries = filter(None, variables.get("CMAKE_PREFIX_PATH", "").split(os.pathsep))
    return any(is_below(name, Path(prefix)) for prefix in (*entries, *_PREFIXES))


def native_environment(tools: NativeTools, variables: Mapping[str, str]) -> dict[str, str]:
    """Return the environment for genuine catkin, with the system's Python and genuine ROS's distribution.

    Args:
        variables: the user's environment, which may be set up for pipros.
    """
    left_out = ("VIRTUAL_ENV", "PYTHONHOME", "ROS_ROOT", "ROS_ETC_DIR")
    result = {name: value for name, value in variables.items() if name not in left_out}
    folder = os.path.dirname(os.path.abspath(sys.executable))
    entries = [entry for entry in result.get("PATH", os.defpath).split(os.pathsep) if entry != folder]
    result |= DISTRIBUTION
    if tools.prefix != Path("/usr"):
        entries.insert(0, str(tools.prefix / "bin"))
        result["PYTHONPATH"] = str(tools.prefix / "lib" / "python3" / "dist-packages")
        result["ROS_DISTRO"] = tools.prefix.name
    else:
        result.pop("PYTHONPATH", None)
        result["ROS_DISTRO"] = _DEBIAN
    result["PATH"] = os.pathsep.join(entries)
    # CMake 4 would reject Noetic's packages, which require CMake 3.0.2. CMake 3 ignores the variable.
    result.setdefault("CMAKE_POLICY_VERSION_MINIMUM", "3.5")
    underlays = result.get("CMAKE_PREFIX_PATH", "")
    result["CMAKE_PREFIX_PATH"] = os.pathsep.join(filter(None, [underlays, str(tools.prefix)]))
    return result
