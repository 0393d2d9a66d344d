"""Gives packages with compiled code to genuine catkin and CMake, when they are installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.workspace.build_options import BuildOptions
from pipros.workspace.catkin.names import CORE_PACKAGES
from pipros.workspace.index import SHARED_PACKAGES
from pipros.workspace.layout import Layout, SourcePackage, read_source_space

_PREFIXES = ("/opt/ros/noetic", "/opt/ros/one", "/opt/ros/melodic", "/usr")
_TOPLEVEL = "share/catkin/cmake/toplevel.cmake"


@dataclass(frozen=True, slots=True)
class NativeTools:
    """Where CMake and genuine catkin are. `prefix` is catkin's: `/opt/ros/noetic`, or `/usr`."""

    cmake: str
    prefix: Path

    @property
    def toplevel(self) -> Path:
        return self.prefix / _TOPLEVEL


def find_tools(variables: Mapping[str, str]) -> NativeTools | str:
    """The tools, or in words what is missing and what to install."""
    path = variables.get("PATH")
    cmake = shutil.which("cmake", path=path)
    if cmake is None:
        return (
            "there is no cmake in PATH to do that. Install CMake, a C++ compiler and genuine catkin "
            "(Debian: apt install cmake g++ catkin ros-core-dev), or put a file CATKIN_IGNORE into its folder"
        )
    if shutil.which("make", path=path) is None or shutil.which("c++", path=path) is None:
        return "there is no compiler in PATH to do that. Install it (Debian: apt install make g++)"
    toplevel = find_toplevel(variables)
    if toplevel is not None:
        return NativeTools(cmake, toplevel.parents[3])
    return (
        "genuine catkin is not installed, which is needed for compiled code. Install it (Debian: apt install "
        "catkin ros-core-dev), or put a file CATKIN_IGNORE into the package's folder"
    )


def find_toplevel(variables: Mapping[str, str] | None = None) -> Path | None:
    """The top-level `CMakeLists.txt` that genuine catkin has for workspaces; None without catkin."""
    prefix_path = (os.environ if variables is None else variables).get("CMAKE_PREFIX_PATH", "")
    for prefix in (*filter(None, prefix_path.split(os.pathsep)), *_PREFIXES):
        if Path(prefix, _TOPLEVEL).is_file():
            return Path(prefix, _TOPLEVEL)
    return None


def build(
    tools: NativeTools,
    packages: Sequence[SourcePackage],
    layout: Layout,
    options: BuildOptions,
    say: Callable[[str], None],
) -> str | None:
    """Builds the packages given into the devel space; what they need of the workspace must be among them.

    Packages that come with pipros, and that genuine ROS lacks on this machine, are built with them.

    Returns what went wrong, None when nothing did. What the tools print is passed on as it comes.
    """
    place = layout.build / "pipros" / "native"
    source, binary = place / "src", place / "build"
    shutil.rmtree(source, ignore_errors=True)
    source.mkdir(parents=True)
    binary.mkdir(parents=True, exist_ok=True)
    (source / "CMakeLists.txt").symlink_to(tools.toplevel)
    variables = _environment(tools)
    prefixes = map(Path, variables["CMAKE_PREFIX_PATH"].split(os.pathsep))
    others = [prefix for prefix in prefixes if prefix not in (layout.devel, layout.install)]
    shipped = shipped_packages(packages, others)
    for package in shipped:
        say(f"-- {package.name} is not in genuine ROS here: its messages are those that come with pipros")
    for package in (*shipped, *packages):
        (source / package.name).symlink_to(package.folder)
    python = "/usr/bin/python3"
    configure = [
        tools.cmake,
        str(source),
        f"-DCATKIN_DEVEL_PREFIX={layout.devel}",
        f"-DCMAKE_INSTALL_PREFIX={layout.install}",
        f"-DPYTHON_EXECUTABLE={python}",
        "-G",
        "Unix Makefiles",
        *(f"-D{name}={value}" for name, value in options.definitions.items()),
    ]
    steps = [configure, ["make", *(options.jobs or (f"-j{os.cpu_count() or 1}",))]]
    if options.installs:
        steps.append(["make", "install"])
    for step in steps:
        say(f'####\n#### Running command: "{" ".join(step)}" in "{binary}"\n####')
        sys.stdout.flush()
        ended = subprocess.run(step, cwd=binary, env=variables, check=False)  # noqa: S603
        if ended.returncode != 0:
            return f'Invoking "{" ".join(step[:2])}" failed; what the tools said about it is above'
    return None


def make(layout: Layout, target: str) -> str | None:
    """Makes one more target of packages that were built; what went wrong, None when nothing did."""
    tools = find_tools(os.environ)
    if isinstance(tools, str):
        return f"[{target}] has to be compiled, and {tools}"
    folder = layout.build / "pipros" / "native" / "build"
    sys.stdout.flush()
    ended = subprocess.run(["make", target], cwd=folder, env=_environment(tools), check=False)  # noqa: S603, S607
    return None if ended.returncode == 0 else f'Invoking "make {target}" failed'


def shipped_packages(packages: Sequence[SourcePackage], prefixes: Sequence[Path]) -> list[SourcePackage]:
    """Message packages of pipros that these need, directly or not, and that CMake finds below no prefix."""
    shipped = {package.name: package for package in read_source_space(SHARED_PACKAGES, os.environ).packages}
    seen = {*CORE_PACKAGES, *(package.name for package in packages)}
    needed: list[SourcePackage] = []
    pending = list(packages)
    while pending:
        for name in sorted(pending.pop().all_dependencies & shipped.keys() - seen):
            seen.add(name)
            config = Path("share", name, "cmake", f"{name}Config.cmake")
            if not any((prefix / config).is_file() for prefix in prefixes):
                needed.append(shipped[name])
                pending.append(shipped[name])
    return needed


def _environment(tools: NativeTools) -> dict[str, str]:
    """This process's environment as genuine catkin wants it: the system's Python, not a virtual one."""
    variables = {
        name: value for name, value in os.environ.items() if name not in ("VIRTUAL_ENV", "PYTHONHOME")
    }
    own = os.path.dirname(os.path.abspath(sys.executable))
    entries = [entry for entry in variables.get("PATH", os.defpath).split(os.pathsep) if entry != own]
    if tools.prefix != Path("/usr"):
        entries.insert(0, str(tools.prefix / "bin"))
        variables["PYTHONPATH"] = str(tools.prefix / "lib" / "python3" / "dist-packages")
    else:
        variables.pop("PYTHONPATH", None)
    variables["PATH"] = os.pathsep.join(entries)
    underlays = variables.get("CMAKE_PREFIX_PATH", "")
    variables["CMAKE_PREFIX_PATH"] = os.pathsep.join(filter(None, [underlays, str(tools.prefix)]))
    return variables
