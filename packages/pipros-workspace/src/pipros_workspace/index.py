"""An index of ROS packages: on `ROS_PACKAGE_PATH`, installed by pip, shipped with pipros, or from Debian."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from pipros.basics.env import Environment
from pipros.basics.errors import NotFound
from pipros.basics.similar_names import near_names
from pipros.basics.windows import ON_WINDOWS, SETUP_FILE
from pipros.packages import SHARES
from pipros.packages.crawl import DRY_MANIFEST, MANIFEST, PACKAGES, crawl
from pipros.packages.installed_packages import is_installed_share, share_folders
from pipros.packages.package_folders import PackageFolders
from pipros.packages.system_packages import in_search_order, is_share_folder

SHIPPED_FOLDERS = tuple(Path(each).resolve() for each in SHARES)
"""The folders of the packages that pipros and the installed plugins ship."""

SHARED_PACKAGES = SHIPPED_FOLDERS[0]
"""The folder of the packages that pipros ships."""


class Package(NamedTuple):
    """A ROS package: the name in its manifest, and the folder of the manifest."""

    name: str
    path: Path

    @property
    def manifest_file(self) -> Path:
        """The package's `package.xml`, or `manifest.xml` for a dry package."""
        file = self.path / MANIFEST
        dry = self.path / DRY_MANIFEST
        return dry if not file.is_file() and dry.is_file() else file


class PackageIndex:
    """Packages by name. If a name occurs twice, the package in the earlier folder wins. Thread-safe.

    See `PackageFolders` for when the disk is read, and which data is cached.
    """

    def __init__(
        self, folders: Sequence[Path], *, cache_folder: Path | None = None, kinds: Sequence[str] = PACKAGES
    ) -> None:
        """Store the arguments; the disk is read on first use.

        Args:
            folders: the folders to search; repeated folders are ignored.
            cache_folder: the folder in which search results are cached; None for no cache.
            kinds: the kinds of packages to find: `PACKAGES` or `STACKS`.
        """
        self.folders = tuple(dict.fromkeys(folders))
        cache = None if cache_folder is None else os.fspath(cache_folder)
        self._found = PackageFolders([os.fspath(folder) for folder in self.folders], cache, kinds)

    @property
    def advice(self) -> str:
        """Advice on correcting ROS_PACKAGE_PATH, for errors about missing packages.

        Empty if the path lists at least one folder other than those of pipros, pip and Debian, and all of
        these other folders exist.
        """
        cure = (
            "source the setup file of your workspace, or export ROS_PACKAGE_PATH=FOLDER "
            "with the folder of its packages"
        )
        if ON_WINDOWS:
            cure = (
                r"run devel\setup.bat of the workspace, or set ROS_PACKAGE_PATH to the folder of its packages"
            )
        folders = [
            folder
            for folder in self.folders
            if folder not in SHIPPED_FOLDERS
            and not is_share_folder(str(folder))
            and not is_installed_share(str(folder))
        ]
        missing = [str(folder) for folder in folders if not folder.exists()]
        if missing:
            verb = "does" if len(missing) == 1 else "do"
            if ON_WINDOWS and any(":" in each[2:] for each in missing):
                cure = "on Windows, separate its folders with a semicolon"
            return f"ROS_PACKAGE_PATH lists [{os.pathsep.join(missing)}], which {verb} not exist: {cure}"
        return "" if folders else f"ROS_PACKAGE_PATH lists no workspace: {cure}"

    @classmethod
    def from_environment(
        cls, environment: Environment | None = None, kinds: Sequence[str] = PACKAGES
    ) -> PackageIndex:
        """Return the index of the packages visible to a ROS process with this environment.

        If a name occurs more than once, the order of precedence is: `ROS_PACKAGE_PATH`, packages that pip
        installed, packages shipped with pipros, Debian's packages.
        """
        environment = environment or Environment.from_os()
        return cls(
            [
                Path(folder)
                for folder in in_search_order(
                    map(str, environment.package_path), share_folders(), [*map(str, SHIPPED_FOLDERS)]
                )
            ],
            cache_folder=environment.ros_home / "pipros" / "packages",
            kinds=kinds,
        )

    def get(self, name: str) -> Package | None:
        """Return the package called `name`, or None."""
        folder = self._found.get(name)
        return None if folder is None else Package(name, Path(folder))

    def find(self, name: str) -> Package:
        """Return the package called `name`.

        Raises:
            NotFound: the package does not exist; the message lists the searched folders.
        """
        package = self.get(name)
        if package is None:
            searched = os.pathsep.join(str(folder) for folder in self.folders)
            near = near_names(name, [each.name for each in self])
            raise NotFound(
                f"package [{name}] not found in [{searched}]; "
                + (f"did you mean {' or '.join(near)}? " if near else "")
                + f"is the workspace's {SETUP_FILE} sourced, or its folder on ROS_PACKAGE_PATH?"
            )
        return package

    def __iter__(self) -> Iterator[Package]:
        """Iterate over all packages, sorted by name. Each name occurs once."""
        folders = self._found.by_name()
        return iter([Package(name, Path(folders[name])) for name in sorted(folders)])

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.get(name) is not None

    def candidates(self, name: str) -> list[Package]:
        """Return all packages called `name`. The first package is used, and hides the others."""
        return [Package(name, Path(folder)) for found, folder in self._found.occurrences() if found == name]

    def containing(self, path: Path) -> Package | None:
        """Return the package whose folder is or contains `path`, or None if there is none."""
        for folder in (path.absolute(), *path.absolute().parents):
            if (folder / MANIFEST).is_file() or (folder / DRY_MANIFEST).is_file():
                found = crawl(str(folder)).packages
                return Package(found[0].name, folder) if found else None
        return None

    def duplicates(self) -> dict[str, list[Path]]:
        """Return each name that occurs more than once, with all its folders. The first folder is used.

        Duplicates that only involve pipros's and Debian's folders are omitted.
        """
        folders: dict[str, list[Path]] = {}
        for name, folder in self._found.occurrences():
            known, path = folders.setdefault(name, []), Path(folder)
            if not is_share_folder(str(path.parent)) or (known and known[0].parent not in SHIPPED_FOLDERS):
                known.append(path)
        return {name: paths for name, paths in sorted(folders.items()) if len(paths) > 1}
