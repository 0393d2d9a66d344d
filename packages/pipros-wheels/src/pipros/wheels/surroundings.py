"""The packages that a build of wheels knows: those to build, their siblings, installed ones, and wheels."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from email.parser import HeaderParser
from pathlib import Path

from pipros.packages.crawl import MANIFEST
from pipros.packages.system_packages import is_share_folder
from pipros.wheels.dependencies import Dependency, dependencies_of, is_shipped
from pipros.wheels.index import names_in
from pipros.wheels.names import PREFIX, normalized
from pipros.workspace.catkin.project import Project
from pipros.workspace.index import PackageIndex
from pipros.workspace.layout import SourcePackage


class Surroundings:
    """The packages known to a build.

    Attributes:
        without_wheel: packages that no wheel may require, because theirs is not built.
    """

    def __init__(self, packages: Sequence[SourcePackage], folders: Sequence[Path] = ()) -> None:
        """Find the siblings of the packages, and the wheels in `folders` and in pip's and uv's folders."""
        self.without_wheel: set[str] = set()
        self._folders = {package.name: package.folder for package in packages}
        self._index = PackageIndex.from_environment()
        self._given = set(self._folders)
        for parent in dict.fromkeys(package.folder.parent for package in packages):
            for manifest in parent.glob(f"*/{MANIFEST}"):
                self._folders.setdefault(manifest.parent.name, manifest.parent)
        self._named = names_in([*folders, *_find_links(os.environ)])
        for package in packages:
            self._named |= _names_in_source_archive(package.folder)

    def folder(self, name: str) -> Path | None:
        """Return the folder of a package, or None."""
        folder = self._folders.get(name)
        if folder is None:
            found = self._index.get(name)
            folder = None if found is None else found.path
        return folder

    def dependencies_of(
        self, package: SourcePackage, project: Project | None, keys: Mapping[str, str]
    ) -> list[Dependency]:
        """Return the run-time dependencies of a package, sorted by name."""
        return dependencies_of(package, project, self._has_wheel, keys)

    def _has_wheel(self, name: str) -> bool:
        """Return whether a ROS package with this name is or could be distributed as a wheel."""
        if name in self.without_wheel:
            return False
        if name in self._given or normalized(PREFIX + name) in self._named:
            return True
        if is_shipped(name):
            return False
        installed = self._index.get(name)
        is_debians = installed is not None and is_share_folder(str(installed.path.parent))
        return name in self._folders or (installed is not None and not is_debians)


def _find_links(variables: Mapping[str, str]) -> list[Path]:
    """Return the folders of wheels that the variables of pip and uv name."""
    words = [*variables.get("PIP_FIND_LINKS", "").split(), *variables.get("UV_FIND_LINKS", "").split(",")]
    return [Path(word.removeprefix("file://")) for word in words if word]


def _names_in_source_archive(folder: Path) -> set[str]:
    """Return the distribution names of the ROS packages that the metadata of a source archive requires.

    The set is empty if `folder` is not an unpacked source archive.
    """
    try:
        text = (folder / "PKG-INFO").read_text("utf-8")
    except (OSError, UnicodeDecodeError):
        return set()
    required = HeaderParser().parsestr(text).get_all("Requires-Dist") or []
    return {
        item.split(">")[0].split("<")[0].split("=")[0].strip() for item in required if item.startswith(PREFIX)
    }
