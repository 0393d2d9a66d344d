"""Finds the program that a package and an executable's name mean, for rosrun, roslaunch and rostest.

Programs that a build made (`devel/lib/<package>`) come before those in the package's folder. A name
without a folder is searched at any depth; `scripts/talker.py` is matched against the end of the path.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.workspace.index import Package
from pipros.workspace.overlays import BuiltWorkspace, built_workspaces

_ON_WINDOWS = os.name == "nt"

# What a name may stand for where files have no executable bit; the first that exists wins.
_WINDOWS_SUFFIXES = ("", ".exe", ".bat", ".cmd", ".py")


@dataclass(frozen=True, slots=True)
class Executables:
    """What was found under a name.

    Attributes:
        runnable: files that may be executed, in the order of preference: built ones first.
        unusable: things of that name that are no files, or lack the permission to be executed.
        searched: the folders that were searched, those of builds first.
    """

    runnable: tuple[Path, ...]
    unusable: tuple[Path, ...]
    searched: tuple[Path, ...]

    @property
    def relay(self) -> Path | None:
        """The built program, when the only other candidate is the source script that it relays to."""
        if len(self.runnable) != 2:
            return None
        built, source = self.runnable
        *builds, package = self.searched
        is_relay = any(_is_below(built, folder) for folder in builds) and _is_below(source, package)
        return built if is_relay else None


def find_executables(
    package: Package, name: str, workspaces: Sequence[BuiltWorkspace] | None = None
) -> Executables:
    """All that `name` can mean in `package`.

    `workspaces` are the built workspaces to look into, by default those of `CMAKE_PREFIX_PATH`;
    only the first of them that has programs of this package counts.
    """
    if workspaces is None:
        workspaces = built_workspaces()
    builds = [workspace.executables_of(package.name) for workspace in workspaces]
    searched = [*[folder for folder in builds if folder.is_dir()][:1], package.path]
    runnable: dict[str, Path] = {}
    unusable: list[Path] = []
    for folder in searched:
        for path in _named(folder, name):
            if not _is_executable(path):
                unusable.append(path)
            else:
                runnable.setdefault(os.path.realpath(path), path)
    return Executables(tuple(runnable.values()), tuple(unusable), tuple(searched))


def list_executables(package: Package, workspaces: Sequence[BuiltWorkspace] | None = None) -> list[str]:
    """The names of all programs of a package, sorted, for completion and for suggestions."""
    if workspaces is None:
        workspaces = built_workspaces()
    folders = [workspace.executables_of(package.name) for workspace in workspaces] + [package.path]
    files = (Path(here, name) for folder in folders for here, name in _walk(folder))
    return sorted({path.name for path in files if _is_executable(path)})


def _named(folder: Path, name: str) -> Iterator[Path]:
    wanted = Path(name).parts
    if not wanted or Path(name).is_absolute():
        return
    suffixes = _WINDOWS_SUFFIXES if _ON_WINDOWS else ("",)
    bases = {wanted[-1] + suffix for suffix in suffixes}
    for here, base in _walk(folder, with_folders=True):
        if base in bases and _ends_with(here, wanted[:-1]):
            yield Path(here, base)


def _walk(folder: Path, *, with_folders: bool = False) -> Iterator[tuple[str, str]]:
    """Folder and name of everything below a folder, sorted; no hidden folders, links followed once."""
    visited: set[str] = set()
    for here, folders, files in os.walk(folder, followlinks=True):
        real = os.path.realpath(here)
        if real in visited:
            folders.clear()
            continue
        visited.add(real)
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files + folders if with_folders else files):
            yield here, name


def _is_executable(path: Path) -> bool:
    if not path.is_file():
        return False
    return _ON_WINDOWS or os.access(path, os.X_OK)


def _ends_with(folder: str, parts: tuple[str, ...]) -> bool:
    return not parts or Path(folder).parts[-len(parts) :] == parts


def _is_below(path: Path, folder: Path) -> bool:
    return path.is_relative_to(folder)
