"""`catkin_init_workspace`: prepares a source folder so that genuine catkin can also build it."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.replaced_file import write_whole
from pipros_tools.cli.entry_point import command
from pipros_workspace.native_tools import find_toplevel

_TOPLEVEL = """\
# Created by pipros's catkin_init_workspace, for genuine catkin, wherever it is installed.
# pipros builds this workspace without this file.
cmake_minimum_required(VERSION 3.0.2)
find_file(TOPLEVEL toplevel.cmake
  PATHS ENV CMAKE_PREFIX_PATH /opt/ros/noetic /opt/ros/one /opt/ros/melodic /usr
  PATH_SUFFIXES share/catkin/cmake
  NO_DEFAULT_PATH)
include(${TOPLEVEL})
"""


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Initialize the given folder or, by default, the working directory. Return the exit code."""
    parser = ArgumentParser(
        prog="catkin_init_workspace",
        description="Initializes a catkin workspace by creating a top-level CMakeLists.txt.",
    )
    parser.add_argument(
        "workspace", nargs="?", default=".", help="The path to an existing folder (default: .)"
    )
    folder = Path(parser.parse_args(list(sys.argv[1:] if argv is None else argv)).workspace).absolute()
    if not folder.is_dir():
        parser.error(f'Workspace "{folder}" does not exist')
    file = folder / "CMakeLists.txt"
    if file.exists() or file.is_symlink():
        print(f'File "{file}" already exists', file=sys.stderr)
        return 2
    print(initialize(folder))
    return 0


def initialize(source: Path) -> str:
    """Create a source folder's top-level `CMakeLists.txt`. Return a line that describes what was done."""
    file = source / "CMakeLists.txt"
    toplevel = find_toplevel()
    if toplevel is not None:
        file.symlink_to(toplevel)
        return f'Creating symlink "{file}" pointing to "{toplevel}"'
    write_whole(file, _TOPLEVEL.encode())
    return f'Creating file "{file}"'


if __name__ == "__main__":
    sys.exit(main())
