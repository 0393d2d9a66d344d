"""Use genuine catkin and CMake to build packages with compiled code."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from pipros.basics.input_file import open_file, read_file
from pipros.basics.replaced_file import write_whole
from pipros_workspace.build_options import BuildOptions
from pipros_workspace.cmake_runs import configure, make_all, run
from pipros_workspace.layout import SourcePackage, WorkspaceFolders
from pipros_workspace.native_tools import PYTHON, MissingTools, NativeTools, find_tools, native_environment
from pipros_workspace.shipped_packages import has_cmake, shipped_packages, write_configuration


def build(
    tools: NativeTools,
    packages: Sequence[SourcePackage],
    layout: WorkspaceFolders,
    options: BuildOptions,
    say: Callable[[str], object],
    variables: Mapping[str, str],
    components: Mapping[str, Collection[str]],
) -> dict[str, str]:
    """Build packages into the devel space, and install them if `options.installs` is true.

    Return the packages that could not be built, each with the reason. The reason is empty if the cause is a
    dependency that could not be built. All other packages are built. The tools use this process's standard
    output.

    Message packages shipped with pipros are also built if a package needs them and the local ROS installation
    lacks them. Python packages need no build. Blocks until the tools exit, without a time limit.

    Args:
        packages: the packages to build, including their dependencies in the workspace, in build order.
        say: called with each line that pipros itself prints.
        variables: the environment.
        components: names that each package passes to `find_package()`, by package.

    Raises:
        NativeBuildFailed: a tool failed, but its output names no package as the cause.
        OSError: the build space cannot be written.
    """
    native = _NativeBuild(tools, packages, layout, options, say, variables)
    native.configure_packages(components)
    if native.rest:
        native.make_packages()
        if options.installs:
            native.install_packages()
    for prefix in (layout.devel, layout.install):
        use_python_of_environment(prefix)
    return native.failed


class _NativeBuild:
    """A build with genuine catkin, step by step. Each step moves packages from `rest` to `failed`."""

    def __init__(
        self,
        tools: NativeTools,
        packages: Sequence[SourcePackage],
        layout: WorkspaceFolders,
        options: BuildOptions,
        say: Callable[[str], object],
        variables: Mapping[str, str],
    ) -> None:
        self.rest = list(packages)
        self.failed: dict[str, str] = {}
        self._tools, self._layout, self._options, self._say = tools, layout, options, say
        self._folder = layout.build / "pipros" / "native"
        self._binary = self._folder / "build"
        self._binary.mkdir(parents=True, exist_ok=True)
        self._variables = native_environment(tools, variables)

    def configure_packages(self, components: Mapping[str, Collection[str]]) -> None:
        """Run CMake, and again without the packages that it rejects, until it rejects none."""
        # If this workspace is sourced, catkin would read all of its manifests, and stop at a bad one.
        own = (str(self._layout.devel), str(self._layout.install))
        prefixes = self._variables["CMAKE_PREFIX_PATH"].split(os.pathsep)
        underlays = os.pathsep.join(prefix for prefix in prefixes if prefix not in own)
        command = [
            self._tools.cmake,
            str(self._folder / "src"),
            f"-DCATKIN_DEVEL_PREFIX={self._layout.devel}",
            f"-DCMAKE_INSTALL_PREFIX={self._layout.install}",
            f"-DPYTHON_EXECUTABLE={PYTHON}",
            "-G",
            "Unix Makefiles",
            *(f"-D{name}={value}" for name, value in self._options.definitions.items()),
        ]
        while self.rest:
            wanted = {name for package in self.rest for name in components.get(package.name, ())}
            provided = _link_sources(self._tools, self.rest, self._folder, underlays, self._say, wanted)
            self._variables["CMAKE_PREFIX_PATH"] = os.pathsep.join([underlays, str(provided)])
            _announce(command, self._binary, self._say)
            folders = {package.name: package.folder for package in self.rest}
            rejected = configure(command, self._binary, self._variables, folders)
            if not rejected:
                return
            _add_failed(self.rest, rejected, self.failed)
            for package in self.rest:
                if not self.failed.keys().isdisjoint(package.all_dependencies):
                    self.failed.setdefault(package.name, "")
            self._drop_failed()

    def make_packages(self) -> None:
        jobs = self._options.jobs or (f"-j{os.cpu_count() or 1}",)
        _announce(["make", *jobs], self._binary, self._say)
        names = [package.name for package in self.rest]
        _add_failed(self.rest, make_all(jobs, self._binary, self._variables, names), self.failed)
        self._drop_failed()

    def install_packages(self) -> None:
        # `make install` would first make the packages that failed.
        folders = [self._binary / each.name for each in self.rest] if self.failed else [self._binary]
        for built in folders:
            command = [self._tools.cmake, "-P", str(built / "cmake_install.cmake")]
            _announce(command, self._binary, self._say)
            run(command, self._binary, self._variables)

    def _drop_failed(self) -> None:
        self.rest = [package for package in self.rest if package.name not in self.failed]


def _link_sources(
    tools: NativeTools,
    packages: Sequence[SourcePackage],
    folder: Path,
    underlays: str,
    say: Callable[[str], object],
    components: Collection[str],
) -> Path:
    """Create a source folder with the packages and the pipros packages that they need.

    Return the prefix with the configuration files of packages that need no build.
    """
    source, provided = folder / "src", folder / "provided"
    shutil.rmtree(source, ignore_errors=True)
    shutil.rmtree(provided, ignore_errors=True)
    source.mkdir(parents=True)
    (source / "CMakeLists.txt").symlink_to(tools.toplevel)
    others = [Path(prefix) for prefix in underlays.split(os.pathsep)]
    for package in shipped_packages(packages, others, components):
        if has_cmake(package):
            say(
                f"-- {package.name} is not installed: its messages are built from those that come with pipros"
            )
            (source / package.name).symlink_to(package.folder)
        else:
            write_configuration(package, provided)
            if package.name in components:
                say(f"-- {package.name} is not installed: CMake finds the one from pipros, which has no C++")
    for package in packages:
        (source / package.name).symlink_to(package.folder)
    return provided


def _add_failed(
    packages: Sequence[SourcePackage], reasons: Mapping[str, str], failed: dict[str, str]
) -> None:
    """Add the packages in `reasons` to `failed`, with an empty reason if one of their dependencies failed."""
    for package in packages:
        if package.name in reasons:
            is_culprit = failed.keys().isdisjoint(package.all_dependencies)
            failed[package.name] = reasons[package.name] if is_culprit else ""


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
    command = [
        tools.cmake,
        str(package.folder),
        f"-DCMAKE_INSTALL_PREFIX={prefix}",
        "-G",
        "Unix Makefiles",
        *(f"-D{name}={value}" for name, value in options.definitions.items()),
    ]
    for step in (command, ["make", *(options.jobs or (f"-j{os.cpu_count() or 1}",))], ["make", "install"]):
        _announce(step, binary, say)
        run(step, binary, native_environment(tools, variables))


def _announce(command: Sequence[str], folder: Path, say: Callable[[str], object]) -> None:
    say(f'####\n#### Running command: "{" ".join(command)}" in "{folder}"\n####')


def use_python_of_environment(prefix: Path) -> None:
    """Change the shebangs of Python programs written by genuine catkin to `#!/usr/bin/env python3`.

    catkin writes genuine rospy's interpreter into these shebangs, even if pipros provides `rosrun` and
    `roslaunch`.

    Raises:
        OSError: a program cannot be written.
    """
    wrong = f"#!{PYTHON}".encode()
    for folder in (prefix / "bin", *(prefix / "lib").glob("*")):
        for program in folder.iterdir() if folder.is_dir() else ():
            if program.is_symlink() or not program.is_file():
                continue
            with open_file(program) as file:
                if file.readline(len(wrong) + 1).rstrip() != wrong:
                    continue
            write_whole(program, b"#!/usr/bin/env python3" + read_file(program)[len(wrong) :])


def make(layout: WorkspaceFolders, target: str) -> None:
    """Make an additional target in packages that have already been built.

    Raises:
        MissingTools: a tool is not installed.
        NativeBuildFailed: make failed.
    """
    try:
        tools = find_tools(os.environ)
    except MissingTools as error:
        raise MissingTools(f"[{target}] must be compiled, but {error}") from None
    folder = layout.build / "pipros" / "native" / "build"
    run(["make", target], folder, native_environment(tools, os.environ))
