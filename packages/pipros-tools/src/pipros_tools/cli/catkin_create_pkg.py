"""`catkin_create_pkg`: runs catkin_pkg's command, for Noetic unless `ROS_DISTRO` names another release."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from catkin_pkg.cli.create_pkg import main as create_package
from catkin_pkg.package import InvalidPackage

from pipros_tools.cli.entry_point import command
from pipros_tools.launch.roscore import ROS_DISTRO


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Create the package in the working directory. Return 1 if its manifest would be invalid.

    If a file cannot be written, those that were written are removed, so that the command can be repeated.

    Exit with code 2 if the arguments are invalid.
    """
    os.environ.setdefault("ROS_DISTRO", ROS_DISTRO)
    before = _package_files()
    try:
        create_package(list(sys.argv[1:] if argv is None else argv))
    except OSError as error:
        for file in _package_files() - before:
            error.filename = error.filename or str(file.parent)
            file.unlink()
            with suppress(OSError):  # the folder has other files
                file.parent.rmdir()
        raise
    except InvalidPackage as error:
        print(f"catkin_create_pkg: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    return 0


def _package_files() -> set[Path]:
    return {file for name in ("package.xml", "CMakeLists.txt") for file in Path().glob(f"*/{name}")}


if __name__ == "__main__":
    sys.exit(main())
