"""Provide `importlib.metadata` with the versions of the ROS Python packages shipped with pipros.

In Noetic, `importlib.metadata.version("rospy")` returns the version of the ROS package. Metadata files in the
environment would also work, but `pip freeze` would then list distributions that pip cannot install.
"""

from __future__ import annotations

import os
import re
from importlib.machinery import PathFinder
from importlib.metadata import Distribution
from typing import Any

from pipros.packages import SHARE
from pipros.packages.crawl import MANIFEST

_VERSION = re.compile(r"<version>\s*([^\s<]+)\s*</version>")


class ShippedDistribution(Distribution):
    """A ROS package with Python modules, as a distribution. The version is taken from its manifest."""

    def __init__(self, name: str) -> None:
        """Store the name of a package in `SHARE`. Its manifest is read on demand."""
        self._name = name

    def read_text(self, filename: str) -> str | None:
        """Return the content of `METADATA`, or None for all other files."""
        if filename != "METADATA":
            return None
        with open(os.path.join(SHARE, self._name, MANIFEST), encoding="utf-8") as file:
            version = _VERSION.search(file.read())
        lines = ["Metadata-Version: 2.1", f"Name: {self._name}"]
        return "\n".join([*lines, f"Version: {version[1] if version else '0'}", ""])

    def locate_file(self, path: Any) -> Any:
        """Return the path of one of the distribution's files.

        Args:
            path: a path relative to the folder that contains the distribution's modules.
        """
        from pathlib import Path

        return Path(_module_folder(self._name) or SHARE, path)


def shipped_distribution(name: str) -> Distribution | None:
    """Return the distribution with the given name, or None if there is none.

    Dashes, dots and underscores are equivalent, as in pip.
    """
    name = re.sub(r"[-.]+", "_", name)
    if not name.isidentifier() or not os.path.isfile(os.path.join(SHARE, name, MANIFEST)):
        return None
    return None if _module_folder(name) is None else ShippedDistribution(name)


def _module_folder(name: str) -> str | None:
    """Return the folder that contains a ROS package's Python package, or None if there is none."""
    if os.path.isdir(os.path.join(SHARE, name, "src", name)):
        return os.path.join(SHARE, name, "src")
    found = PathFinder.find_spec(name)
    locations = None if found is None else found.submodule_search_locations
    return os.path.dirname(next(iter(locations))) if locations else None
