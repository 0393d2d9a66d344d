"""Read a package of the source space, check it, and print what catkin prints about it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.windows import relative_path
from pipros.msg.language.definitions import Definitions
from pipros_workspace.catkin.context import FindPackage
from pipros_workspace.catkin.project import Project
from pipros_workspace.catkin.project_reader import read_project
from pipros_workspace.layout import SourcePackage, WorkspaceError
from pipros_workspace.validate import check_interfaces, check_manifest

if TYPE_CHECKING:
    from pipros.basics.printable import Say


def read_checked(
    package: SourcePackage,
    source: Path,
    settings: Mapping[str, str],
    variables: Mapping[str, str],
    *,
    find_for_cmake: FindPackage,
    find_folder: Callable[[str], Path | None],
    definitions: Definitions,
    say: Say,
) -> Project:
    """Read and check a package.

    Args:
        source: the source space.
        settings: CMake variables.
        variables: the environment.

    Raises:
        PiprosError: the package is for ROS 2, has no `CMakeLists.txt`, or contains an error.
    """
    if package.build_type.startswith("ament"):
        raise WorkspaceError(
            f"{package.manifest_file}: the package is for ROS 2 (build type {package.build_type}). Check "
            "out its branch for ROS 1, or put a file named CATKIN_IGNORE into its folder"
        )
    if not os.path.lexists(package.folder / "CMakeLists.txt"):
        raise WorkspaceError(f"{package.folder}: the package has no CMakeLists.txt")
    say(f"-- ==> add_subdirectory({relative_path(str(package.folder), str(source))})")
    status_lines: list[str] = []
    try:
        project = read_project(
            str(package.folder),
            package.name,
            settings,
            variables,
            find_for_cmake,
            str(package.manifest.version),
            status_lines=status_lines,
        )
        check_manifest(project, package)
        check_interfaces(project, definitions, find_folder)
    except PiprosError:
        for line in status_lines:
            say(line)
        raise
    _print_contents(project, say)
    return project


def _print_contents(project: Project, say: Say) -> None:
    counts = {
        kind: sum(interface.kind == kind for interface in project.interfaces)
        for kind in ("msg", "srv", "action")
    }
    if project.interfaces:
        say("-- Using these message generators: genpy")
        messages = counts["msg"] + 7 * counts["action"]
        say(f"-- {project.name}: {messages} messages, {counts['srv']} services")
        if not project.generate_messages_line:
            say(f"-- WARNING: {project.name} lists message files but never calls generate_messages()")
    for line in project.status_lines:
        say(line)
    for warning in project.warnings:
        say(f"-- WARNING: {warning}")
