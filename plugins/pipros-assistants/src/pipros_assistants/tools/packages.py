"""Tools for packages and launch files. Launch files are not evaluated, because that could run commands."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from pipros.basics.files_below import file_inside, files_below
from pipros.basics.input_file import read_text
from pipros_assistants.answer import Answer, ToolRefused
from pipros_assistants.robot import RobotAccess
from pipros_assistants.tools.arguments import Cursor, Name
from pipros_workspace.index import PackageIndex

LAUNCH_SUFFIXES: Final = (".launch", ".test", ".launch.xml")
LAUNCH_BYTES: Final = 512 * 1024
_PACKAGE = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


class PackageTools:
    """Tools for packages and launch files."""

    def __init__(self, robot: RobotAccess) -> None:
        self._robot = robot

    def list_packages(self, cursor: Cursor = 0) -> Answer:
        """List the ROS packages that are installed here or in the workspaces of this environment."""
        index = PackageIndex.from_environment(self._robot.environment)
        rows = [package.name for package in index]
        return Answer(rows, figures={"packages": len(rows)})

    def list_launch_files(self, package: Name, cursor: Cursor = 0) -> Answer:
        """List the launch files and rostest files of a package."""
        return Answer(list(files_below(_folder(self._robot, package), LAUNCH_SUFFIXES)))

    def read_launch_file(self, package: Name, file: Name, cursor: Cursor = 0) -> Answer:
        """Show a launch file of a package, line by line. It is not evaluated, and included files are not
        opened. file is a name from list_launch_files."""
        found = launch_file(self._robot, package, file)
        return Answer(read_text(found, LAUNCH_BYTES, errors="replace").splitlines())


def launch_file(robot: RobotAccess, package: str, file: str) -> Path:
    """Return the path of a launch file.

    Raises:
        ToolRefused: the package does not exist, or the file is not a launch file.
        NotBelow: the file does not exist, or its name or a link leads out of the package.
    """
    if not file.endswith(LAUNCH_SUFFIXES):
        raise ToolRefused("only launch files and rostest files can be used", file)
    return file_inside(_folder(robot, package), file)


def _folder(robot: RobotAccess, package: str) -> Path:
    if not _PACKAGE.fullmatch(package):
        raise ToolRefused("this is not the name of a package", package)
    index = PackageIndex.from_environment(robot.environment)
    found = index.get(package)
    if found is None:
        raise ToolRefused(
            "this package is not installed; list_packages lists the installed packages",
            package,
            [each.name for each in index],
        )
    return found.path
