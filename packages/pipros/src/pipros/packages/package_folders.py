"""Find package folders by name, for `PackageIndex` and for importing messages.

Paths are strings and imports are few, because the first import of a message in every process needs this
module. All other code uses `PackageIndex`.
"""

from __future__ import annotations

import os
from binascii import crc32

from pipros.basics.cache_files import CacheFolder
from pipros.packages.crawl import PACKAGES, Crawl, CrawledPackage, crawl, dump, load, read_package
from pipros.packages.installed_packages import find_in, folders_in, is_installed_share
from pipros.packages.system_packages import is_share_folder, manifest_folder, manifest_folders

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` takes milliseconds
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

# If there are fewer folders and packages than this, crawling is as fast as reading the cache.
_WORTH_CACHING = 40


class PackageFolders:
    """Finds package folders by name. If a name occurs twice, the earlier root takes precedence.

    A root is crawled when it is first searched, and again if a name is missing and the disk has changed.
    Crawls of large roots are stored below `cache_folder`, so that the next process can find one of hundreds
    of packages in a millisecond. A cache that cannot be read or written, or that other users could have
    modified (`CacheFolder`), is not used. Thread-safe.
    """

    def __init__(
        self, roots: Sequence[str], cache_folder: str | None = None, kinds: Sequence[str] = PACKAGES
    ) -> None:
        """Store the settings without reading the disk.

        Packages of kinds other than `kinds` are ignored. Roots may also be Debian's folder and the share
        folders into which pip installs packages.
        """
        cache = None if cache_folder is None else CacheFolder(cache_folder)
        self._kinds = kinds
        self._roots = [_root(root, cache, kinds) for root in roots]

    def get(self, name: str) -> str | None:
        """Return the package's folder, or None."""
        for root in self._roots:
            folder = root.get(name)
            if folder is not None:
                return folder
        return None

    def by_name(self) -> dict[str, str]:
        """Return the folder for each name. The earliest root takes precedence."""
        folders: dict[str, str] = {}
        for name, folder in self.occurrences():
            folders.setdefault(name, folder)
        return folders

    def occurrences(self) -> Iterator[tuple[str, str]]:
        """Yield the name and folder of every package. Of equal names, the first one takes precedence."""
        for root in self._roots:
            for package in root.packages():
                if package.kind in self._kinds:
                    yield package.name, package.path


def _root(folder: str, cache: CacheFolder | None, kinds: Sequence[str]) -> _SystemRoot | _Root:
    if is_share_folder(folder):
        return _SystemRoot(kinds)
    if is_installed_share(folder):
        return _InstalledRoot(folder, kinds)
    return _Root(os.path.abspath(folder), cache, kinds)


class _SystemRoot:
    """Debian's packages.

    Each call reads the disk: `get` reads one manifest, and `packages` reads all of them, which takes 1 ms.
    """

    __slots__ = ("_kinds",)

    def __init__(self, kinds: Sequence[str]) -> None:
        self._kinds = kinds

    def get(self, name: str) -> str | None:
        folder = self._folder(name) if name.isprintable() else None
        package = None if folder is None else read_package(folder)
        if package is None or package.name != name or package.kind not in self._kinds:
            return None
        return package.path

    def packages(self) -> Sequence[CrawledPackage]:
        found = map(read_package, self._folders())
        return [package for package in found if package is not None]

    def _folder(self, name: str) -> str | None:
        return manifest_folder(name)

    def _folders(self) -> Iterator[str]:
        return manifest_folders()


class _InstalledRoot(_SystemRoot):
    """The packages that pip installed in a share folder. The disk is read on each call."""

    __slots__ = ("_share",)

    def __init__(self, share: str, kinds: Sequence[str]) -> None:
        super().__init__(kinds)
        self._share = share

    def _folder(self, name: str) -> str | None:
        return find_in(self._share, name)

    def _folders(self) -> Iterator[str]:
        return folders_in(self._share)


class _Root:
    """A folder and its latest crawl.

    The disk is not read before the first call. A cached crawl is trusted for a package whose manifest is
    unchanged, and for the absence of a package if the whole folder is unchanged. A crawl by this process is
    trusted for its packages as long as the process runs.
    """

    __slots__ = ("_cache", "_cache_name", "_folder", "_is_own", "_kinds", "_known")

    def __init__(self, folder: str, cache: CacheFolder | None, kinds: Sequence[str]) -> None:
        self._kinds = kinds
        self._folder = folder
        self._cache = cache
        self._cache_name = f"{crc32(os.fsencode(folder)):08x}"
        self._known: tuple[Crawl, dict[str, CrawledPackage]] | None = None
        self._is_own = False

    def get(self, name: str) -> str | None:
        known = self._known
        if known is None:
            kept = self._read_cache()
            known = self._crawl() if kept is None else self._learn(kept, is_own=False)
            is_fresh = kept is None
        else:
            is_fresh = False
        package = known[1].get(name)
        if package is not None and (self._is_own or package.is_current()):
            return package.path
        if not is_fresh and not known[0].is_current():
            package = self._crawl()[1].get(name)
        return None if package is None else package.path

    def packages(self) -> Sequence[CrawledPackage]:
        """Return all packages in the folder. The result may be as old as the first call to any method."""
        known = self._known
        if known is None or not self._is_own:
            kept = self._read_cache() if known is None else known[0]
            is_good = kept is not None and kept.is_current()
            known = self._learn(kept, is_own=True) if kept is not None and is_good else self._crawl()
        return known[0].packages

    def _learn(self, found: Crawl, *, is_own: bool) -> tuple[Crawl, dict[str, CrawledPackage]]:
        packages: dict[str, CrawledPackage] = {}
        for package in found.packages:
            if package.kind in self._kinds:
                packages.setdefault(package.name, package)
        self._is_own = is_own
        self._known = found, packages
        return self._known

    def _crawl(self) -> tuple[Crawl, dict[str, CrawledPackage]]:
        found = crawl(self._folder)
        if self._cache is not None and len(found.folders) + len(found.packages) >= _WORTH_CACHING:
            text = dump(found)
            if text is not None:
                self._cache.write(self._cache_name, text.encode("utf-8", "surrogateescape"))
        return self._learn(found, is_own=True)

    def _read_cache(self) -> Crawl | None:
        kept = None if self._cache is None else self._cache.read(self._cache_name)
        return None if kept is None else load(kept.decode("utf-8", "surrogateescape"), self._folder)
