"""`catkin_create_pkg`: runs catkin_pkg's command, for Noetic unless `ROS_DISTRO` names another release."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from catkin_pkg.cli.create_pkg import main as create_package
from catkin_pkg.package import InvalidPackage

from pipros.cli.entry_point import command
from pipros.launch.roscore import ROS_DISTRO


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Create the package in the working directory. Return 1 if its manifest would be invalid.

    Exit with code 2 if the arguments are invalid.
    """
    os.environ.setdefault("ROS_DISTRO", ROS_DISTRO)
    try:
        create_package(list(sys.argv[1:] if argv is None else argv))
    except InvalidPackage as error:
        print(f"catkin_create_pkg: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
