"""The C++ nodes of ROS 1 navigation, compiled for Debian 12, to compare with: see its README.

The archive is in `../shared/oracles` beside the project. It is unpacked once for all runs on this machine.
"""

from __future__ import annotations

import os
import tarfile
from pathlib import Path

import pytest

from tests.support.once import machine_folder, make_once
from tests.support.ros import Side
from tests.support.ros2_oracles import ARCHIVES

ARCHIVE = ARCHIVES / "navigation-bookworm.tar.xz"


def unpacked() -> Path:
    """Return the folder with `lib` and `share` of the packages."""
    if not ARCHIVE.exists():
        lacking = pytest.fail if os.environ.get("CI") else pytest.skip
        lacking(f"the compiled nodes of genuine navigation are missing: put them at {ARCHIVE}")
    folder = machine_folder("navigation-oracle", [ARCHIVE])

    def unpack() -> None:
        with tarfile.open(ARCHIVE) as archive:
            archive.extractall(folder)  # noqa: S202 (the project's own archive)

    return make_once(folder, unpack) / "navigation-bookworm"


def add_to(side: Side) -> Path:
    """Make the packages visible to the programs of a side. Return the folder of the packages."""
    folder = unpacked()
    side.environment["ROS_PACKAGE_PATH"] = f"{folder / 'share'}:/usr/share"
    side.environment["CMAKE_PREFIX_PATH"] = f"{folder}:/usr"
    side.environment["LD_LIBRARY_PATH"] = str(folder / "lib")
    return folder
