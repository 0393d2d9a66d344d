"""Read a package's `CMakeLists.txt`.

As in CMake, the file is executed command by command. The commands that packages without compiled code need
have handlers, in the tables of `*_commands.py`. For other CMake commands, the file and line are recorded as a
reason to build the package with genuine catkin.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from pipros.basics.env import DISTRIBUTION
from pipros.basics.input_file import read_text
from pipros.basics.limits import Limits
from pipros.basics.windows import with_slashes
from pipros.cmake.language import Command
from pipros.cmake.names import BEYOND_COMMANDS, BUILTIN_COMMANDS
from pipros.cmake.scope import Scope
from pipros.workspace.catkin import (
    install_commands,
    interface_commands,
    package_commands,
    target_commands,
    templates,
    testing_commands,
)
from pipros.workspace.catkin.context import FindPackage, FoundPackage, Handler, ReadContext
from pipros.workspace.catkin.names import CATKIN_COMMANDS, COMPONENT_COMMANDS
from pipros.workspace.catkin.project import Project
from pipros.workspace.catkin.variables import package_variables

_HANDLERS: Mapping[str, Handler] = {
    **package_commands.COMMANDS,
    **interface_commands.COMMANDS,
    **install_commands.COMMANDS,
    **target_commands.COMMANDS,
    **testing_commands.COMMANDS,
    **templates.COMMANDS,
}


def read_project(
    folder: str,
    name: str,
    settings: Mapping[str, str],
    environment: Mapping[str, str],
    find_package: FindPackage = lambda _name: FoundPackage(),
    version: str = "",
    limits: Limits | None = None,
    status_lines: list[str] | None = None,
) -> Project:
    """Execute a package's `CMakeLists.txt`. Like CMake, this runs programs and writes files.

    Args:
        name: the package's name in its manifest.
        settings: `-D` settings from the command line, and the workspace's folders.
        environment: the values of `$ENV{NAME}`; `ROS_DISTRO` and similar variables default to Noetic's
            values.
        find_package: function that finds the packages that the file needs.
        version: the package's version in its manifest.
        limits: defaults to the process-wide limits.
        status_lines: receives the output of `message()`, even if an error follows.

    Raises:
        CMakeError: the file is invalid, or reports an error; the message names the file and line.
    """
    project = Project(name, folder, os.path.join(folder, "CMakeLists.txt"))
    if status_lines is not None:
        project.status_lines = status_lines
    variables = {name: with_slashes(value) for name, value in package_variables(name, folder).items()}
    settings = {
        name: with_slashes(value) if os.path.isabs(value) else value for name, value in settings.items()
    }
    unset = {name: value for name, value in variables.items() if name not in settings}
    environment = {**DISTRIBUTION, **environment}
    scope = Scope(unset, {"CATKIN_ENABLE_TESTING": "ON", **settings}, environment, limits)
    scope.cache.setdefault("CMAKE_CURRENT_BINARY_DIR", with_slashes(os.path.join(folder, "build")))
    project.binary = scope.values["CMAKE_CURRENT_BINARY_DIR"]
    ReadContext(project, version, scope, find_package, _HANDLERS, _check_known).run()
    return project


def _check_known(context: ReadContext, command: Command, _words: list[str]) -> None:
    """Reject unknown commands, and record commands that only CMake can run."""
    name = command.name
    if name in BEYOND_COMMANDS:
        context.need_cmake(command, f"{command.written_name}()")
    if name in BUILTIN_COMMANDS or name in CATKIN_COMMANDS:
        needed = COMPONENT_COMMANDS.get(name)
        if needed is None or context.components.intersection(needed):
            return
        wanted = needed[0]
        raise context.error(
            command,
            f'Unknown CMake command "{command.written_name}".\n  It comes with {wanted}: '
            f"add {wanted} to find_package(catkin REQUIRED COMPONENTS …) and to package.xml",
        )
    from difflib import get_close_matches

    for file in context.project.cfg_extras:
        if not context.empy_hint and name in read_text(file, errors="replace").lower():
            # CMake runs these extras only in packages that find this one.
            context.need_cmake(
                command,
                f"{command.written_name}(), which the package's own {os.path.basename(file)} defines: call "
                f"find_package({context.project.name}) after catkin_package()",
            )
            return
    near = get_close_matches(name, [*BUILTIN_COMMANDS, *CATKIN_COMMANDS], n=1, cutoff=0.8)
    is_typo = bool(near) and not name.endswith(f"_{near[0]}")  # unlike cs_install(), of catkin_simple
    if context.has_foreign_packages and not is_typo:
        context.need_cmake(
            command, f"{command.written_name}(), which another package provides{context.empy_hint}"
        )
        return
    hint = f"\n  Did you mean {near[0]}?" if near else ""
    raise context.error(command, f'Unknown CMake command "{command.written_name}".{hint}')
