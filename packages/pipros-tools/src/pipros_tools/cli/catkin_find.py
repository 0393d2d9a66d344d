"""`catkin_find`: finds files and folders of packages in the active workspaces."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence

from pipros_tools.cli.entry_point import command

_FOLDERS = {
    "bin": 'Search in "bin" folder',
    "etc": 'Search in "etc(/PROJECT)" folder',
    "include": 'Search in "include(/PROJECT)" folder',
    "lib": 'Search in "lib" folder',
    "libexec": 'Search in "lib/PROJECT" folder',
    "share": 'Search in "share(/PROJECT)" folder (and source of PROJECT if not installed)',
}


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the paths found. Return 1 on errors, or if `--first-only` finds nothing; otherwise 0."""
    from pipros_workspace.find_files import WrongFolders, find_files
    from pipros_workspace.index import SHIPPED_FOLDERS
    from pipros_workspace.overlays import BuiltWorkspace, built_workspaces

    parser = ArgumentParser(
        prog="catkin_find",
        description="Searches the catkin workspaces for project-specific files/folders.",
    )
    parser.add_argument("project", nargs="?", help="The project to find a path for")
    parser.add_argument(
        "path", nargs="?", help="The relative path of a project file/folder (a prefix is sufficient)"
    )
    parser.add_argument(
        "--first-only", action="store_true", help="Flag if only the first result should be returned"
    )
    parser.add_argument(
        "--without-underlays",
        action="store_true",
        help="Flag if further workspaces should be skipped after finding matches in one workspace",
    )
    group = parser.add_argument_group("Search folders", "Restrict the folders to search in")
    for folder, text in _FOLDERS.items():
        group.add_argument(f"--{folder}", dest="folders", action="append_const", const=folder, help=text)
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    # The shipped packages form the lowest workspaces, like /opt/ros/noetic in Noetic.
    workspaces = [*built_workspaces(), *(BuiltWorkspace(each.parent) for each in SHIPPED_FOLDERS)]
    try:
        found = find_files(
            workspaces,
            options.project or "",
            options.path or "",
            options.folders or (),
            only_first_workspace=options.without_underlays,
            only_first=options.first_only,
        )
    except WrongFolders as error:
        print(error, file=sys.stderr)
        return 1
    if options.first_only and not found.existing:
        print("Could not find any path, checked the following paths:", file=sys.stderr)
        print("\n".join(found.considered), file=sys.stderr)
        return 1
    if found.existing:
        print("\n".join(found.existing))
    return 0


if __name__ == "__main__":
    sys.exit(main())
