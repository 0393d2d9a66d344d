"""`catkin_topological_order`: lists the packages in a workspace in build order."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser
from collections.abc import Sequence

from pipros_tools.cli.entry_point import command


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the packages' names and folders. Return 1 on errors and 3 if the folder contains no packages."""
    parser = ArgumentParser(
        prog="catkin_topological_order",
        description="Outputs the catkin projects of a workspace in topological order.",
    )
    add = parser.add_argument
    add("workspace", nargs="?", default=".", help="The path to a workspace (default: .)")
    add(
        "--underlay-workspaces",
        nargs="*",
        default=[],
        help="The paths to underlay workspaces which are only used to resolve dependencies",
    )
    add("--only-folders", action="store_true", help="Only output the project folders")
    add("--only-names", action="store_true", help="Only output the project names")
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    if options.only_folders and options.only_names:
        parser.error('Use either "--only-folders" or "--only-names" but not both')
    workspace = os.path.abspath(options.workspace)
    if not os.path.isdir(workspace):
        print(f'Workspace "{workspace}" does not exist', file=sys.stderr)
        return 1
    from catkin_pkg.package import InvalidPackage
    from catkin_pkg.topological_order import topological_order

    try:
        ordered = topological_order(workspace, underlay_workspaces=options.underlay_workspaces)
    except (InvalidPackage, RuntimeError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    if not ordered:
        print(
            f'Workspace "{workspace}" seems to not contain any projects. Have you passed the correct path to '
            "a catkin workspace?",
            end="",
            file=sys.stderr,
        )
        return 3
    for path, package in ordered:
        if path is None:
            print(f"The workspace contains packages with a circular dependency: {package}", file=sys.stderr)
            return 1
        if options.only_folders:
            print(path)
        else:
            print(package.name if options.only_names else f"{package.name} {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
