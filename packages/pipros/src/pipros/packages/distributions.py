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

from pipros.packages import has_only_messages, shipped_folder
from pipros.packages.crawl import MANIFEST

_VERSION = re.compile(r"<version>\s*([^\s<]+)\s*</version>")


class ShippedDistribution(Distribution):
    """A ROS package with Python modules, as a distribution. The version is taken from its manifest."""

    def __init__(self, name: str) -> None:
        """Store the name of a shipped package. Its manifest is read on demand."""
        self._name = name
        self._folder = shipped_folder(name) or ""

    def read_text(self, filename: str) -> str | None:
        """Return the content of `METADATA`, or None for all other files."""
        if filename != "METADATA":
            return None
        with open(os.path.join(self._folder, MANIFEST), encoding="utf-8") as file:
            version = _VERSION.search(file.read())
        lines = ["Metadata-Version: 2.1", f"Name: {self._name}"]
        return "\n".join([*lines, f"Version: {version[1] if version else '0'}", ""])

    def locate_file(self, path: Any) -> Any:
        """Return the path of one of the distribution's files.

        Args:
            path: a path relative to the folder that contains the distribution's modules.
        """
        from pathlib import Path

        return Path(_module_folder(self._name) or self._folder, path)


def shipped_distribution(name: str) -> Distribution | None:
    """Return the distribution with the given name, or None if there is none.

    Dashes, dots and underscores are equivalent, as in pip.
    """
    name = re.sub(r"[-.]+", "_", name)
    folder = shipped_folder(name) if name.isidentifier() else None
    if folder is None or not os.path.isfile(os.path.join(folder, MANIFEST)):
        return None
    return None if _module_folder(name) is None else ShippedDistribution(name)


def _module_folder(name: str) -> str | None:
    """Return the folder that contains a ROS package's Python package, or None if there is none."""
    source = os.path.join(shipped_folder(name) or "", "src")
    if os.path.isdir(os.path.join(source, name)):
        return source
    found = PathFinder.find_spec(name)
    folder = next(iter(found.submodule_search_locations or ()), None) if found is not None else None
    return None if folder is None or has_only_messages(folder) else os.path.dirname(folder)
