"""Folders and definitions of installed packages, of ROS 1 and ROS 2."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from pipros.basics.errors import NotFound
from pipros.packages.installed_packages import AMENT_INDEX, share_folders
from pipros_rosbag2.interfaces.catalog import Ros1Definitions


def folders_of_environment(environment: Mapping[str, str]) -> list[Path]:
    """Return the `share` folders of ROS 2: those of `AMENT_PREFIX_PATH`, and those of installed wheels."""
    listed = environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    wheels = (Path(each) for each in share_folders() if Path(each, AMENT_INDEX).is_dir())
    return [*(Path(each) / "share" for each in listed if each), *wheels]


def installed_definitions() -> Ros1Definitions:
    """Return the definitions of the installed ROS 1 packages."""
    from pipros.msg.importing.hook import installed_library

    definitions = installed_library().definitions
    return Ros1Definitions(definitions.message, definitions.service)


def installed_package(name: str) -> Path | None:
    """Return the folder of an installed ROS 1 package, or None."""
    from pipros.msg.importing.hook import installed_library

    try:
        return Path(installed_library().definitions.files.folder(name))
    except NotFound:
        return None
