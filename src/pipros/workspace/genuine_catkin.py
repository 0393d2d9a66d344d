"""Gives packages with compiled code to genuine catkin and CMake, when they are installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.errors import PiprosError
from pipros.workspace.build_options import BuildOptions
from pipros.workspace.catkin.names import CORE_PACKAGES
from pipros.workspace.index import SHARED_PACKAGES
from pipros.workspace.layout import Layout, SourcePackage, read_source_space

_PREFIXES = ("/opt/ros/noetic", "/opt/ros/one", "/opt/ros/melodic", "/usr")
_TOPLEVEL = "share/catkin/cmake/toplevel.cmake"


class MissingTools(PiprosError):
    """CMake, a compiler or genuine catkin is not installed. The text says what to install."""


class NativeBuildFailed(PiprosError):
    """CMake or make failed. Their output is above this error in the terminal."""


@dataclass(frozen=True, slots=True)
class NativeTools:
    """Where CMake and genuine catkin are. `prefix` is catkin's: `/opt/ros/noetic`, or `/usr`."""

    cmake: str
    prefix: Path

    @property
    def toplevel(self) -> Path:
        return self.prefix / _TOPLEVEL


def find_tools(variables: Mapping[str, str]) -> NativeTools:
    """Finds CMake and genuine catkin, and checks that there is a compiler.

    Args:
        variables: the environment; `PATH` and `CMAKE_PREFIX_PATH` count.

    Raises:
        MissingTools: with what to install.
    """
    path = variables.get("PATH")
    cmake = shutil.which("cmake", path=path)
    if cmake is None:
        raise MissingTools(
            "cmake is not in PATH. Install CMake, a C++ compiler and genuine catkin "
            "(Debian: apt install cmake g++ catkin ros-core-dev), or put a file CATKIN_IGNORE into its folder"
        )
    if shutil.which("make", path=path) is None or shutil.which("c++", path=path) is None:
        raise MissingTools("make or c++ is not in PATH. Install them (Debian: apt install make g++)")
    toplevel = find_toplevel(variables)
    if toplevel is not None:
        return NativeTools(cmake, toplevel.parents[3])
    raise MissingTools(
        "genuine catkin is not installed. Install it (Debian: apt install catkin ros-core-dev), "
        "or put a file CATKIN_IGNORE into its folder"
    )


def has_tools(variables: Mapping[str, str]) -> bool:
    """Whether everything that compiled code needs is installed."""
    try:
        find_tools(variables)
    except MissingTools:
        return False
    return True


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
    say: Callable[[str], object],
) -> None:
    """Builds packages into the devel space. The output of the tools goes to that of this process.

    Packages that come with pipros, and that genuine ROS lacks on this machine, are built with them.

    Args:
        packages: must include the packages of the workspace that the others need.
        say: called with each line that pipros itself has to print.

    Raises:
        NativeBuildFailed: a tool failed.
        OSError: the build space cannot be written.
    """
    folder = layout.build / "pipros" / "native"
    source, binary = folder / "src", folder / "build"
    shutil.rmtree(source, ignore_errors=True)
    source.mkdir(parents=True)
    binary.mkdir(parents=True, exist_ok=True)
    (source / "CMakeLists.txt").symlink_to(tools.toplevel)
    variables = native_environment(tools)
    prefixes = map(Path, variables["CMAKE_PREFIX_PATH"].split(os.pathsep))
    others = [prefix for prefix in prefixes if prefix not in (layout.devel, layout.install)]
    shipped = shipped_packages(packages, others)
    for package in shipped:
        say(f"-- {package.name} is not installed: its messages are built from those that come with pipros")
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
        _run(step, binary, variables, f'Invoking "{" ".join(step[:2])}" failed; the reason is printed above')


def make(layout: Layout, target: str) -> None:
    """Makes one more target of packages that were built before.

    Raises:
        MissingTools: a tool was removed since.
        NativeBuildFailed: make failed.
    """
    try:
        tools = find_tools(os.environ)
    except MissingTools as error:
        raise MissingTools(f"[{target}] has to be compiled, but {error}") from None
    folder = layout.build / "pipros" / "native" / "build"
    _run(["make", target], folder, native_environment(tools), f'Invoking "make {target}" failed')


def _run(command: Sequence[str], folder: Path, variables: Mapping[str, str], failure: str) -> None:
    sys.stdout.flush()
    ended = subprocess.run(command, cwd=folder, env=dict(variables), check=False)  # noqa: S603
    if ended.returncode != 0:
        raise NativeBuildFailed(failure)


def shipped_packages(packages: Sequence[SourcePackage], prefixes: Sequence[Path]) -> list[SourcePackage]:
    """Message packages of pipros that these need, directly or not, and that are installed below no prefix."""
    shipped = {package.name: package for package in read_source_space(SHARED_PACKAGES, os.environ).packages}
    seen = {*CORE_PACKAGES, *(package.name for package in packages)}
    needed: list[SourcePackage] = []
    pending = list(packages)
    while pending:
        for name in sorted(pending.pop().all_dependencies & shipped.keys() - seen):
            seen.add(name)
            if not any(_is_installed(name, prefix) for prefix in prefixes):
                needed.append(shipped[name])
                pending.append(shipped[name])
    return needed


def has_package(tools: NativeTools, name: str) -> bool:
    """Whether genuine ROS on this machine, or a workspace that is set up, has a package."""
    prefixes = native_environment(tools)["CMAKE_PREFIX_PATH"].split(os.pathsep)
    return any(_is_installed(name, Path(prefix)) for prefix in prefixes)


def _is_installed(name: str, prefix: Path) -> bool:
    """Whether CMake finds a package below a prefix.

    catkin installs to `share/<name>/cmake`; Debian moves packages that depend on the processor to
    `lib/<triplet>/cmake/<name>`.
    """
    config = f"{name}Config.cmake"
    if (prefix / "share" / name / "cmake" / config).is_file():
        return True
    return any((prefix / "lib").glob(f"cmake/{name}/{config}")) or any(
        (prefix / "lib").glob(f"*/cmake/{name}/{config}")
    )


def native_environment(tools: NativeTools) -> dict[str, str]:
    """The environment of this process with the system's Python in place of a virtual one."""
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
