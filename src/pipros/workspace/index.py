"""Where the ROS packages are: the folders of `ROS_PACKAGE_PATH`, then the packages that come with pipros."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pipros.env import Environment
from pipros.errors import NotFound
from pipros.workspace import crawl as crawling

SHARED_PACKAGES = Path(__file__).resolve().parent.parent / "share"

# Below this size a fresh crawl is as quick as a look into the cache.
_WORTH_CACHING = 40


@dataclass(frozen=True, slots=True)
class Package:
    """A ROS package: the name that its manifest gives it, and the folder of that manifest."""

    name: str
    path: Path


class PackageIndex:
    """Finds packages by name. When a name occurs twice, the package in the earlier folder wins.

    The folders are crawled when the first question is asked, and again when a name is missed and
    something on disk has changed. Crawls of large folders are kept below `cache_folder`, so that
    the next process finds hundreds of packages in milliseconds; a cache that cannot be written or
    read is done without. May be used from several threads.
    """

    def __init__(self, folders: Sequence[Path], *, cache_folder: Path | None = None) -> None:
        self.folders = tuple(folders)
        self._cache_folder = cache_folder
        self._crawls: list[crawling.Crawl] | None = None
        self._packages: dict[str, Package] = {}

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
        packages = self._current()
        if name not in packages and not self._is_current():
            self._crawls = None
            packages = self._current()
        return packages.get(name)

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
        packages = self._current()
        return iter([packages[name] for name in sorted(packages)])

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.get(name) is not None

    def containing(self, path: Path) -> Package | None:
        """The package that a file or folder lies in, by the nearest manifest above it."""
        for folder in (path.absolute(), *path.absolute().parents):
            if (folder / crawling.MANIFEST).is_file():
                found = crawling.crawl(str(folder)).packages
                return Package(found[0].name, folder) if found else None
        return None

    def duplicates(self) -> dict[str, list[Path]]:
        """Every name that occurs more than once, with all its folders, the winning one first."""
        self._current()
        folders: dict[str, list[Path]] = {}
        for found in self._crawls or ():
            for package in found.packages:
                folders.setdefault(package.name, []).append(Path(package.path))
        return {name: places for name, places in sorted(folders.items()) if len(places) > 1}

    def _current(self) -> dict[str, Package]:
        if self._crawls is None:
            crawls: list[crawling.Crawl] = []
            packages: dict[str, Package] = {}
            for folder in self.folders:
                found = self._crawl(os.path.abspath(folder))
                crawls.append(found)
                for package in found.packages:
                    packages.setdefault(package.name, Package(package.name, Path(package.path)))
            self._packages = packages
            self._crawls = crawls  # last, as it tells other threads that the packages are there
        return self._packages

    def _is_current(self) -> bool:
        return self._crawls is not None and all(found.is_current() for found in self._crawls)

    def _crawl(self, root: str) -> crawling.Crawl:
        cache = self._cache_file(root)
        if cache is not None:
            try:
                found = crawling.load(cache.read_text("utf-8", "surrogateescape"), root)
            except OSError:
                found = None
            if found is not None and found.is_current():
                return found
        found = crawling.crawl(root)
        if cache is not None and len(found.folders) + len(found.packages) >= _WORTH_CACHING:
            _write(cache, crawling.dump(found))
        return found

    def _cache_file(self, root: str) -> Path | None:
        if self._cache_folder is None:
            return None
        return self._cache_folder / f"{zlib.crc32(os.fsencode(root)):08x}"


def _write(cache: Path, text: str | None) -> None:
    """Replaces the cache in one step, so that no reader ever sees half of it."""
    if text is None:
        return
    unfinished = cache.with_name(f"{cache.name}.{os.getpid()}")
    try:
        cache.parent.mkdir(parents=True, exist_ok=True)
        unfinished.write_text(text, "utf-8", "surrogateescape")
        os.replace(unfinished, cache)
    except OSError:
        with suppress(OSError):
            unfinished.unlink()
