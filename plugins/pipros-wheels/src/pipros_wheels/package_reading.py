"""Read the `CMakeLists.txt` of a package for its wheel."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros_wheels.file_tree import WheelRefused
from pipros_workspace.catkin.context import FoundPackage
from pipros_workspace.catkin.project import Project
from pipros_workspace.catkin.project_reader import read_project
from pipros_workspace.layout import SourcePackage
from pipros_workspace.validate import check_interfaces, check_manifest

if TYPE_CHECKING:
    from pipros.basics.printable import Say


FindFolder = Callable[[str], Path | None]
"""Function that returns the folder of a package, or None."""


def read_package(
    package: SourcePackage,
    folder: Path,
    find_folder: FindFolder,
    extras_of: Callable[[str], Sequence[str]],
    say: Say,
) -> Project:
    """Read the package's `CMakeLists.txt`, if it has one. Output is written below `folder`.

    Args:
        find_folder: function that finds required packages, some of which may be missing.
        extras_of: function that returns the CMake files of a package for the packages that find it.

    Raises:
        PiprosError: the file or a message definition is invalid; the error text names the file and line.
    """
    if not os.path.lexists(package.folder / "CMakeLists.txt"):
        project = Project(package.name, str(package.folder), str(package.folder / "CMakeLists.txt"))
        project.has_python_setup = (package.folder / "setup.py").is_file()
        return project

    def find_for_cmake(name: str) -> FoundPackage | None:
        return FoundPackage(extras=extras_of(name)) if find_folder(name) is not None else None

    lines: list[str] = []
    version = str(package.manifest.version)
    project = read_project(
        str(package.folder),
        package.name,
        settings_of(folder),
        os.environ,
        find_for_cmake,
        version,
        status_lines=lines,
    )
    check_manifest(project, package)
    definitions = Definitions(DefinitionFiles(find_folder))
    check_interfaces(project, definitions, find_folder, allows_absent=True)
    _check_names(project)
    for line in lines:
        say(line)
    return project


def settings_of(folder: Path) -> dict[str, str]:
    """Return the CMake variables for a build below a temporary folder."""
    return {
        "CATKIN_DEVEL_PREFIX": str(folder / "devel"),
        "CATKIN_ENABLE_TESTING": "OFF",
        "CMAKE_BINARY_DIR": str(folder / "build"),
        "CMAKE_CURRENT_BINARY_DIR": str(folder / "build"),
        "CMAKE_INSTALL_PREFIX": str(folder / "install"),
    }


def _check_names(project: Project) -> None:
    """Check that no two files define the same type."""
    known: dict[tuple[str, str], str] = {}
    for interface in project.interfaces:
        other = known.setdefault((interface.kind, interface.name), interface.path)
        if other != interface.path:
            raise WheelRefused(
                f"{project.name}/{interface.name} is defined twice: {other} and {interface.path}; rename one"
            )
