"""A workspace built by genuine catkin once per machine, for all runs and workers of pytest-xdist."""

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from tests.support.environments import EXAMPLES, file_of_tests, genuine_environment
from tests.support.once import machine_folder, make_once

_PACKAGES = (
    EXAMPLES / "composiv_tryouts", EXAMPLES / "vehicle_battery", file_of_tests("interop/cpp_battery"),
)  # fmt: skip
_ROSCPP = Path("/usr/share/roscpp/package.xml")  # contains the version
CATKIN = Path("/usr/share/catkin/package.xml")
"""Contains the version of genuine catkin, for `machine_folder`."""
_BUILD_TIMEOUT_S = 300


@dataclass(frozen=True, slots=True)
class CatkinWorkspace:
    """A built workspace.

    Attributes:
        folder: the folder with `src`, `build` and `devel`.
        log: the output of `catkin_make`.
        variables: the environment variables that `source devel/setup.bash` sets.
    """

    folder: Path
    log: str
    variables: dict[str, str]


def build_once() -> CatkinWorkspace:
    """Return a workspace with copies of the examples and the C++ nodes, built by genuine catkin_make.

    The workspace is kept for later runs until one of these packages or roscpp changes.

    Raises:
        AssertionError: the build failed. The message contains the whole output.
    """
    base = machine_folder("catkin", (*_PACKAGES, _ROSCPP, Path(__file__)))
    folder, log, variables = base / "catkin_ws", base / "catkin_make.log", base / "variables.json"

    def make() -> None:
        for package in _PACKAGES:
            shutil.copytree(package, folder / "src" / package.name)
        log.write_text(_run(base, "catkin_make", "-C", str(folder)))
        variables.write_text(json.dumps(_variables_after_sourcing(base, folder)))

    make_once(base, make)
    return CatkinWorkspace(folder, log.read_text(), json.loads(variables.read_text()))


def _variables_after_sourcing(home: Path, folder: Path) -> dict[str, str]:
    listing = _run(home, "bash", "-c", f". '{folder}/devel/setup.bash' && env -0")
    pairs = (entry.partition("=") for entry in listing.split("\0") if "=" in entry)
    names = (
        "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH", "PATH", "PKG_CONFIG_PATH", "PYTHONPATH", "ROS_PACKAGE_PATH",
        "ROSLISP_PACKAGE_DIRECTORIES",
    )  # fmt: skip
    variables = {name: value for name, _, value in pairs if name in names}
    # Debian's packages lack the marker file, so catkin's setup files do not add their folder.
    variables["ROS_PACKAGE_PATH"] += os.pathsep + "/usr/share"
    return variables


def _run(home: Path, *argv: str) -> str:
    environment = genuine_environment(home, "http://127.0.0.1:1")
    # The system's packages are the workspace's underlay, as after `source /opt/ros/noetic/setup.bash`.
    environment |= {"CMAKE_PREFIX_PATH": "/usr", "MAKEFLAGS": f"-j{os.cpu_count() or 1}"}
    ended = subprocess.run(
        argv, env=environment, cwd=home, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        timeout=_BUILD_TIMEOUT_S, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, f"{' '.join(argv)} ended with {ended.returncode}:\n{ended.stdout}"
    return ended.stdout
