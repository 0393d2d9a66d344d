"""Where the ROS packages are: the folders of `ROS_PACKAGE_PATH`, then the packages that come with pipros."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.env import Environment
from pipros.errors import NotFound
from pipros.packages import SHARE
from pipros.packages.crawl import MANIFEST, crawl
from pipros.packages.package_folders import PackageFolders

SHARED_PACKAGES = Path(SHARE).resolve()


@dataclass(frozen=True, slots=True)
class Package:
    """A ROS package: the name that its manifest gives it, and the folder of that manifest."""

    name: str
    path: Path


class PackageIndex:
    """Finds packages by name. When a name occurs twice, the package in the earlier folder wins.

    When it looks at the disk, and what it keeps there, is said at `PackageFolders`. May be used from
    several threads.
    """

    def __init__(self, folders: Sequence[Path], *, cache_folder: Path | None = None) -> None:
        self.folders = tuple(folders)
        cache = None if cache_folder is None else os.fspath(cache_folder)
        self._found = PackageFolders([os.fspath(folder) for folder in folders], cache)

    @classmethod
    def from_environment(cls, environment: Environment | None = None) -> PackageIndex:
        """The packages that a ROS process of this environment can see."""
        environment = environment or Environment.from_os()
        return cls(
            (*environment.package_path, SHARED_PACKAGES),
            cache_folder=environment.ros_home / "pipros" / "packages",
        )

    def get(self, name: str) -> Package | None:
        """The package of that name, None when there is none."""
        folder = self._found.get(name)
        return None if folder is None else Package(name, Path(folder))

    def find(self, name: str) -> Package:
        """The package of that name.

        Raises:
            NotFound: saying where it was looked for.
        """
        package = self.get(name)
        if package is None:
            searched = os.pathsep.join(str(folder) for folder in self.folders)
            raise NotFound(
                f"package [{name}] not found. It was looked for in [{searched}]; "
                f"is the workspace's devel/setup.bash sourced, or its folder on ROS_PACKAGE_PATH?"
            )
        return package

    def __iter__(self) -> Iterator[Package]:
        """All packages, each name once, sorted by name."""
        folders = self._found.by_name()
        return iter([Package(name, Path(folders[name])) for name in sorted(folders)])

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.get(name) is not None

    def containing(self, path: Path) -> Package | None:
        """The package that a file or folder lies in, by the nearest manifest above it."""
        for folder in (path.absolute(), *path.absolute().parents):
            if (folder / MANIFEST).is_file():
                found = crawl(str(folder)).packages
                return Package(found[0].name, folder) if found else None
        return None

    def duplicates(self) -> dict[str, list[Path]]:
        """Every name that occurs more than once, with all its folders, the winning one first."""
        folders: dict[str, list[Path]] = {}
        for name, folder in self._found.occurrences():
            folders.setdefault(name, []).append(Path(folder))
        return {name: places for name, places in sorted(folders.items()) if len(places) > 1}
