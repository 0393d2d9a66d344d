"""The small C++ nodes of ROS 1, compiled for Debian 12, to compare with: `SMALL_NODES.md` beside the archive.

It is unpacked once for all runs on this machine.
"""

from __future__ import annotations

import tarfile
from pathlib import Path

import pytest

from tests.support.genuine import is_required
from tests.support.once import machine_folder, make_once
from tests.support.ros import Side
from tests.support.ros2_oracles import ARCHIVES

ARCHIVE = ARCHIVES / "small-nodes-bookworm.tar.xz"


def add_to(side: Side) -> Path:
    """Make the packages visible to the programs of a side. Return the folder with `lib` and `share`."""
    if not ARCHIVE.exists():
        lacking = pytest.fail if is_required() else pytest.skip
        lacking(f"the compiled small nodes are missing: put them at {ARCHIVE}")
    made = machine_folder("small-nodes-oracle", [ARCHIVE])

    def unpack() -> None:
        with tarfile.open(ARCHIVE) as archive:
            archive.extractall(made)  # noqa: S202 (the project's own archive)

    folder = make_once(made, unpack) / "small-nodes"
    side.environment["ROS_PACKAGE_PATH"] = f"{folder / 'share'}:/usr/share"
    side.environment["CMAKE_PREFIX_PATH"] = f"{folder}:/usr"
    side.environment["LD_LIBRARY_PATH"] = str(folder / "lib")
    return folder
