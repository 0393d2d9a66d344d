"""Use genuine catkin and CMake, if installed, to build packages with compiled code."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.env import DISTRIBUTION
from pipros.basics.errors import PiprosError
from pipros.workspace.build_options import BuildOptions
from pipros.workspace.layout import SourcePackage, WorkspaceFolders
from pipros.workspace.shipped_packages import has_cmake, is_below, shipped_packages, write_configuration

_PREFIXES = ("/opt/ros/noetic", "/opt/ros/one", "/opt/ros/melodic", "/usr")
_TOPLEVEL = "share/catkin/cmake/toplevel.cmake"
_PYTHON = "/usr/bin/python3"

# The ROS_DISTRO of Debian's packages. If the variable has another value, one of their environment hooks
# prints a line, which catkin would evaluate as Python.
_DEBIAN = "Debian"


class MissingTools(PiprosError):
    """CMake, a compiler or genuine catkin is not installed. The message says what to install."""


class NativeBuildFailed(PiprosError):
    """CMake or make failed. Their output precedes this error in the terminal."""


@dataclass(frozen=True, slots=True)
class NativeTools:
    """The location of CMake and genuine catkin.

    `prefix` is catkin's prefix, such as `/opt/ros/noetic` or `/usr`.
    """

    cmake: str
    prefix: Path

    @property
    def toplevel(self) -> Path:
        return self.prefix / _TOPLEVEL


def find_tools(variables: Mapping[str, str]) -> NativeTools:
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
            "(Debian: apt install cmake make g++ catkin ros-core-dev), "
            "or put a file CATKIN_IGNORE into the package's folder"
        )
    if shutil.which("make", path=path) is None or shutil.which("c++", path=path) is None:
        raise MissingTools("make or c++ is not in PATH. Install them (Debian: apt install make g++)")
    toplevel = find_toplevel(variables)
    if toplevel is not None:
        return NativeTools(cmake, toplevel.parents[3])
    raise MissingTools(
        "genuine catkin is not installed. Install it (Debian: apt install catkin ros-core-dev), "
        "or put a file CATKIN_IGNORE into the package's folder"
    )


def has_tools(variables: Mapping[str, str]) -> bool:
    """Return whether all tools needed to build C++ packages are installed."""
    try:
        find_tools(variables)
    except MissingTools:
        return False
    return True


def find_toplevel(variables: Mapping[str, str] | None = None) -> Path | None:
    """Return genuine catkin's top-level `CMakeLists.txt` for workspaces, or None if it is not installed."""
    prefix_path = (os.environ if variables is None else variables).get("CMAKE_PREFIX_PATH", "")
    for prefix in (*filter(None, prefix_path.split(os.pathsep)), *_PREFIXES):
        if Path(prefix, _TOPLEVEL).is_file():
            return Path(prefix, _TOPLEVEL)
    return None


def build(
    tools: NativeTools,
    packages: Sequence[SourcePackage],
    layout: WorkspaceFolders,
    options: BuildOptions,
    say: Callable[[str], object],
    variables: Mapping[str, str],
    components: Collection[str] = (),
) -> None:
    """Build packages into the devel space, and install them if `options.installs` is true.

    The tools inherit this process's standard output.

    Message packages shipped with pipros are also built if the local ROS installation lacks them. Python
    packages need no build. Blocks until the tools exit, without a time limit.

    Args:
        packages: the packages to build, including their dependencies in the workspace.
        say: called with each line that pipros itself prints.
        variables: the environment.
        components: names passed to `find_package()`, in addition to the dependencies in the manifests.

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
    variables = native_environment(tools, variables)
    prefixes = map(Path, variables["CMAKE_PREFIX_PATH"].split(os.pathsep))
    others = [prefix for prefix in prefixes if prefix not in (layout.devel, layout.install)]
    shipped = shipped_packages(packages, others, components)
    provided = folder / "provided"
    shutil.rmtree(provided, ignore_errors=True)
    for package in shipped:
        if has_cmake(package):
            say(
                f"-- {package.name} is not installed: its messages are built from those that come with pipros"
            )
            (source / package.name).symlink_to(package.folder)
        else:
            write_configuration(package, provided)
            if package.name in components:
                say(f"-- {package.name} is not installed: CMake finds the one from pipros, which has no C++")
    variables["CMAKE_PREFIX_PATH"] += os.pathsep + str(provided)
    for package in packages:
        (source / package.name).symlink_to(package.folder)
    configure = [
        tools.cmake,
        str(source),
        f"-DCATKIN_DEVEL_PREFIX={layout.devel}",
        f"-DCMAKE_INSTALL_PREFIX={layout.install}",
        f"-DPYTHON_EXECUTABLE={_PYTHON}",
        "-G",
        "Unix Makefiles",
        *(f"-D{name}={value}" for name, value in options.definitions.items()),
    ]
    _carry_out(configure, options, binary, say, variables, installs=options.installs)
    for prefix in (layout.devel, layout.install):
        use_python_of_environment(prefix)


def build_plain(
    tools: NativeTools,
    package: SourcePackage,
    binary: Path,
    prefix: Path,
    options: BuildOptions,
    say: Callable[[str], object],
    variables: Mapping[str, str],
) -> None:
    """Build a plain CMake package without catkin, and install it below `prefix`.

    Raises:
        NativeBuildFailed: a tool failed.
        OSError: the build space cannot be written.
    """
    binary.mkdir(parents=True, exist_ok=True)
    configure = [
        tools.cmake,
        str(package.folder),
        f"-DCMAKE_INSTALL_PREFIX={prefix}",
        "-G",
        "Unix Makefiles",
        *(f"-D{name}={value}" for name, value in options.definitions.items()),
    ]
    _carry_out(configure, options, binary, say, native_environment(tools, variables), installs=True)


def _carry_out(
    configure: Sequence[str],
    options: BuildOptions,
    binary: Path,
    say: Callable[[str], object],
    variables: Mapping[str, str],
    *,
    installs: bool,
) -> None:
    """Run CMake and make in a build folder.

    Raises:
        NativeBuildFailed: a command failed.
    """
    steps = [configure, ["make", *(options.jobs or (f"-j{os.cpu_count() or 1}",))]]
    if installs:
        steps.append(["make", "install"])
    for step in steps:
        say(f'####\n#### Running command: "{" ".join(step)}" in "{binary}"\n####')
        _run(step, binary, variables, f'Invoking "{" ".join(step[:2])}" failed; the reason is printed above')


def use_python_of_environment(prefix: Path) -> None:
    """Change the shebangs of Python programs written by genuine catkin to the first `python3` in `PATH`.

    catkin writes genuine rospy's interpreter into their shebangs, even if pipros provides `rosrun` and
    `roslaunch`.

    Raises:
        OSError: a program cannot be written.
    """
    wrong = f"#!{_PYTHON}".encode()
    for folder in (prefix / "bin", *(prefix / "lib").glob("*")):
        for program in folder.iterdir() if folder.is_dir() else ():
            if program.is_symlink() or not program.is_file():
                continue
            with program.open("rb") as file:
                if file.readline(len(wrong) + 1).rstrip() != wrong:
                    continue
            program.write_bytes(b"#!/usr/bin/env python3" + program.read_bytes()[len(wrong) :])


def make(layout: WorkspaceFolders, target: str) -> None:
    """Make an additional target in packages that have already been built.

    Raises:
        MissingTools: a tool has been removed since the build.
        NativeBuildFailed: make failed.
    """
    try:
        tools = find_tools(os.environ)
    except MissingTools as error:
        raise MissingTools(f"[{target}] must be compiled, but {error}") from None
    folder = layout.build / "pipros" / "native" / "build"
    _run(["make", target], folder, native_environment(tools, os.environ), f'Invoking "make {target}" failed')


def _run(command: Sequence[str], folder: Path, variables: Mapping[str, str], failure: str) -> None:
    sys.stdout.flush()
    ended = subprocess.run(command, cwd=folder, env=dict(variables), check=False)  # noqa: S603
    if ended.returncode != 0:
        raise NativeBuildFailed(failure)


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
    own = os.path.dirname(os.path.abspath(sys.executable))
    entries = [entry for entry in result.get("PATH", os.defpath).split(os.pathsep) if entry != own]
    result |= DISTRIBUTION
    if tools.prefix != Path("/usr"):
        entries.insert(0, str(tools.prefix / "bin"))
        result["PYTHONPATH"] = str(tools.prefix / "lib" / "python3" / "dist-packages")
        result["ROS_DISTRO"] = tools.prefix.name
    else:
        result.pop("PYTHONPATH", None)
        result["ROS_DISTRO"] = _DEBIAN
    result["PATH"] = os.pathsep.join(entries)
    underlays = result.get("CMAKE_PREFIX_PATH", "")
    result["CMAKE_PREFIX_PATH"] = os.pathsep.join(filter(None, [underlays, str(tools.prefix)]))
    return result
