"""Data classes for the contents of a package's `CMakeLists.txt`, which `project_reader.py` reads."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from pipros.basics.input_file import read_text
from pipros_workspace.catkin.installation import Installation
from pipros_workspace.catkin.steps import BuildSteps

PYTHON_DESTINATION = "lib/python3/dist-packages"


EXTRAS = "cmake/cfg_extras.txt"
"""File in the `share` folder of an installed package that lists its CFG_EXTRAS."""


def installed_extras(folder: Path) -> list[str]:
    """Return the CMake files that packages run which find the package installed in `folder`."""
    try:
        names = read_text(folder / EXTRAS).splitlines()
    except (OSError, UnicodeDecodeError):
        return []
    return [str(file) for name in names if (file := folder / "cmake" / os.path.basename(name)).is_file()]


@dataclass(frozen=True, slots=True)
class Interface:
    """A message, service or action file.

    Attributes:
        kind: `msg`, `srv` or `action`.
        folder: the install folder below the package's share folder; None if the file is not installed.
    """

    kind: str
    name: str
    path: str
    folder: str | None = None


@dataclass(frozen=True, slots=True)
class NativeTarget:
    """A reason to build a package with genuine catkin. `what` completes "the package [x] …".

    Attributes:
        target: the compiled target; empty for other reasons, such as an unknown command.
    """

    what: str
    file: str
    line: int
    target: str = ""


@dataclass(frozen=True, slots=True)
class TestEntry:
    """A test that `run_tests` runs.

    Attributes:
        kind: `rostest` for a launch file with tests, `roslaunch` for a launch file or folder to check,
            `python` for a file or folder of unit tests, `gtest` for a compiled program.
        path: the file or folder; for `gtest` the name of the program.
        arguments: arguments for the launch file; for a check, options and arguments.
        written: the path as written in the `CMakeLists.txt`, relative to the package's folder.
        target: the target to compile first; empty if there is none.
        place: file and line, for error texts.
    """

    kind: str
    path: str
    arguments: tuple[str, ...] = ()
    written: str = ""
    target: str = ""
    place: str = ""


@dataclass(frozen=True, slots=True)
class Download:
    """A file to download to `path` for tests. If `md5` is empty, the MD5 sum is not checked."""

    url: str
    path: str
    md5: str = ""


@dataclass(frozen=True, slots=True)
class EnvironmentHook:
    """A file that is sourced by a workspace's setup files.

    Attributes:
        text: the content; None to copy `source`.
        installed: the content in the install space; None if it is the same as in the devel space.
    """

    name: str
    source: str
    text: str | None = None
    installed: str | None = None


@dataclass(frozen=True, slots=True)
class AbsentPackage:
    """A required package that was not found.

    Attributes:
        error: CMake's error, with the file and line.
        place: the file and line of `find_package()`.
    """

    name: str
    error: str
    place: str


@dataclass(slots=True)
class Project:
    """A package as described by its `CMakeLists.txt`.

    Attributes:
        folder, file: the package's folder, and its `CMakeLists.txt`.
        binary: the package's folder in the build space.
        absent: the required packages that were not found; an error in a package with compiled code.
        components, catkin_depends: package names, each with the line that lists it.
        generate_messages_line: the line of `generate_messages()`; 0 if it is not called.
        has_reconfigure_options: whether `generate_dynamic_reconfigure_options()` was called.
        config_files: the `.cfg` files of dynamic_reconfigure, relative to the package's folder.
        needs_cmake: reasons to build the package with genuine catkin; empty if pipros can build it.
        status_lines: output from `message(STATUS)` and similar commands.
        warnings: warnings with file and line.
        cfg_extras: CMake files for packages that find this package.
        installed_extras: their installed forms, by file name.
        targets: the names of targets that can be built individually.
    """

    name: str
    folder: str
    file: str
    binary: str = ""
    absent: list[AbsentPackage] = field(default_factory=list)
    components: list[tuple[str, int]] = field(default_factory=list)
    interfaces: list[Interface] = field(default_factory=list)
    generate_messages_line: int = 0
    message_dependencies: list[str] = field(default_factory=list)
    has_reconfigure_options: bool = False
    config_files: list[str] = field(default_factory=list)
    catkin_depends: list[tuple[str, int]] = field(default_factory=list)
    has_catkin_package: bool = False
    has_python_setup: bool = False
    installations: list[Installation] = field(default_factory=list)
    needs_cmake: list[NativeTarget] = field(default_factory=list)
    steps: BuildSteps = field(default_factory=BuildSteps)
    hooks: list[EnvironmentHook] = field(default_factory=list)
    tests: list[TestEntry] = field(default_factory=list)
    downloads: list[Download] = field(default_factory=list)
    status_lines: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    cfg_extras: list[str] = field(default_factory=list)
    installed_extras: dict[str, str] = field(default_factory=dict)
    targets: set[str] = field(default_factory=set)
