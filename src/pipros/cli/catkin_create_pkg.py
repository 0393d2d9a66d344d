"""`catkin_create_pkg`: catkin_pkg's own command, for Noetic unless `ROS_DISTRO` says otherwise."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from catkin_pkg.cli.create_pkg import main as create_package

from pipros.launch.core import ROS_DISTRO


def main(argv: Sequence[str] | None = None) -> int:
    """Creates the package in the current folder; mistakes in the arguments end with code 2."""
    os.environ.setdefault("ROS_DISTRO", ROS_DISTRO)
    create_package(list(sys.argv[1:] if argv is None else argv))
    return 0


if __name__ == "__main__":
    sys.exit(main())
