"""The built workspaces in `CMAKE_PREFIX_PATH`, topmost overlay first.

A folder on that path is a workspace if it contains a file `.catkin`. In a devel space, the file lists the
source folders of the packages that were built there; in an install space, it is empty.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from pipros.basics.input_file import read_text

MARKER = ".catkin"


class BuiltWorkspace(NamedTuple):
    """A devel or install space: its folder, and the source folders of a devel space."""

    prefix: Path
    sources: tuple[Path, ...] = ()

    def executables_of(self, package: str) -> Path:
        """Return the folder for a package's built programs, even if the folder does not exist."""
        return self.prefix / "lib" / package


def built_workspaces(variables: Mapping[str, str] | None = None) -> tuple[BuiltWorkspace, ...]:
    """Return the workspaces in an environment, by default in this process's environment."""
    prefix_path = (os.environ if variables is None else variables).get("CMAKE_PREFIX_PATH") or ""
    workspaces = []
    for folder in prefix_path.split(os.pathsep):
        try:
            sources = read_text(Path(folder, MARKER)) if folder else None
        except OSError:
            continue
        if sources is not None:
            listed = (Path(source.strip()) for source in sources.split(";") if source.strip())
            workspaces.append(BuiltWorkspace(Path(folder), tuple(listed)))
    return tuple(workspaces)
