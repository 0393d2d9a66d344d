"""Find the ROS packages below a folder, and check later whether the result is still valid.

A folder with a `package.xml` is a package or a metapackage. A folder with a `manifest.xml` is a dry package,
which predates catkin. Packages do not nest, so folders below a package are not searched. Hidden folders
and folders marked with `CATKIN_IGNORE`, `COLCON_IGNORE` or `AMENT_IGNORE` are skipped. A file
`rospack_nosubdirs` ends the search below its folder. Links are followed; each folder is visited once.

A crawl records the modification times of all manifests that it read, and of the folders that it listed,
except the folders of catkin packages. As long as these times are unchanged, no package has been added,
removed or renamed. This check takes one `stat` per entry, which is about fifty times faster than crawling
again.

The first import of a message in every process runs this module, so it imports little: `re`, `pathlib` and
`dataclasses` would each take longer than the crawl of a workspace.
"""

from __future__ import annotations

import os
import time
from stat import S_ISREG

from pipros.basics.posix import READ

MANIFEST = "package.xml"
DRY_MANIFEST = "manifest.xml"

WET, META, DRY = "wet", "meta", "dry"
"""The kinds of packages: catkin packages, catkin metapackages and dry packages."""

PACKAGES = (WET, DRY)
"""The kinds that `rospack` and `rospkg.RosPack` treat as packages."""

STACKS = (WET, META)
"""The kinds that `rosstack` and `rospkg.RosStack` treat as stacks, apart from dry stacks."""

_IGNORE_MARKERS = frozenset(("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE"))
_NO_DESCENT_MARKER = "rospack_nosubdirs"

# A file system may assign the same time to two changes within one clock tick. Therefore, modification times
# within this interval before a crawl are not trusted by later lookups, as in git's index.
_RACY_NS = 2_000_000_000


_NAME_WITHIN_BYTES = 1024 * 1024


class CrawledPackage:
    """A package that a crawl found.

    Attributes:
        path: the package's folder.
        manifest_ns: the manifest's modification time; 0 if it is too recent to be trusted.
        kind: `WET`, `META` or `DRY`.
    """

    __slots__ = ("kind", "manifest_ns", "name", "path")

    def __init__(self, name: str, path: str, manifest_ns: int, kind: str = WET) -> None:
        self.name = name
        self.path = path
        self.manifest_ns = manifest_ns
        self.kind = kind

    def is_current(self) -> bool:
        """Return True if the manifest is unchanged, so that a new crawl would find the same package."""
        try:
            manifest = DRY_MANIFEST if self.kind == DRY else MANIFEST
            return os.stat(os.path.join(self.path, manifest)).st_mtime_ns == self.manifest_ns
        except OSError:
            return False


class Crawl:
    """The packages below `root`, sorted by path.

    `folders` contains the listed folders, except those of catkin packages, with their modification times in
    ns (0 if not trusted).
    """

    __slots__ = ("folders", "packages", "root")

    def __init__(
        self, root: str, folders: tuple[tuple[str, int], ...], packages: tuple[CrawledPackage, ...]
    ) -> None:
        self.root = root
        self.folders = folders
        self.packages = packages

    def is_current(self) -> bool:
        """Return True if a new crawl would have the same result."""
        try:
            if not all(os.stat(path).st_mtime_ns == seen for path, seen in self.folders):
                return False
        except OSError:
            return False
        return all(package.is_current() for package in self.packages)


def crawl(root: str, unreadable: list[str] | None = None) -> Crawl:
    """Return the packages in `root` and below it. Unreadable folders and manifests are left out.

    If `unreadable` is given, it receives a line for each folder and manifest below `root` that is left out.
    """
    left_out = [] if unreadable is None else unreadable
    newest_trusted_ns = time.time_ns() - _RACY_NS
    folders: list[tuple[str, int]] = []
    packages: list[CrawledPackage] = []
    visited: set[tuple[int, int]] = set()
    pending = [root]
    while pending:
        folder = pending.pop()
        try:
            status = os.stat(folder)
            identity = (status.st_dev, status.st_ino)
            if identity in visited:
                continue
            visited.add(identity)
            with os.scandir(folder) as listing:
                entries = {entry.name: entry for entry in listing}
        except OSError as error:
            if folder != root:
                left_out.append(f"{folder}: {error.strerror}")
            continue
        is_ignored = not _IGNORE_MARKERS.isdisjoint(entries)
        package = None if is_ignored else _package_in(folder, entries, newest_trusted_ns, left_out)
        if package is not None:
            packages.append(package)
        if package is None or package.kind == DRY:
            # The folder of a dry package is also recorded, because a package.xml may be added to it.
            changed_ns = status.st_mtime_ns
            folders.append((folder, changed_ns if changed_ns < newest_trusted_ns else 0))
        if package is None and not is_ignored and _NO_DESCENT_MARKER not in entries:
            pending += _folders_in(entries)
    return Crawl(root, tuple(folders), tuple(packages))


def _package_in(
    folder: str, entries: dict[str, os.DirEntry[str]], newest_trusted_ns: int, left_out: list[str]
) -> CrawledPackage | None:
    """Return the package whose manifest is among the entries of a folder, if any."""
    if MANIFEST in entries:
        package = read_package(folder, newest_trusted_ns)
        if package is None and not _is_folder(entries[MANIFEST]):
            left_out.append(f"{entries[MANIFEST].path}: cannot be read, or is not a regular file")
        return package
    if DRY_MANIFEST in entries:
        return _dry_package(entries[DRY_MANIFEST], folder, newest_trusted_ns)
    return None


def _folders_in(entries: dict[str, os.DirEntry[str]]) -> list[str]:
    """Return the folders to visit in reverse order, so that a stack of them makes the walk alphabetical."""
    names = (name for name in sorted(entries, reverse=True) if not name.startswith("."))
    return [entries[name].path for name in names if _is_folder(entries[name])]


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:
        return False


def read_package(folder: str, newest_trusted_ns: int = 0) -> CrawledPackage | None:
    """Return the package whose manifest is in `folder`, or None if the manifest cannot be read.

    The name is found without parsing the XML, because a crawl reads hundreds of manifests. Moreover, a
    package with a malformed manifest must still be found, so that tools can report it.
    """
    manifest = os.path.join(folder, MANIFEST)
    try:
        # Reading a pipe or a device could block the crawl or never end.
        with open(os.open(manifest, READ), "rb") as file:
            status = os.fstat(file.fileno())
            if not S_ISREG(status.st_mode):
                return None
            changed_ns = status.st_mtime_ns
            content = file.read(min(status.st_size, _NAME_WITHIN_BYTES))
    except OSError:
        return None
    content = _without_comments(content)
    name = _name_in(content) or os.path.basename(os.path.abspath(folder))
    kind = META if b"<metapackage" in content else WET
    return CrawledPackage(name, folder, changed_ns if changed_ns < newest_trusted_ns else 0, kind)


def _dry_package(manifest: os.DirEntry[str], folder: str, newest_trusted_ns: int) -> CrawledPackage | None:
    """Return the dry package in `folder`, or None if its manifest is not a regular file.

    The package has the name of the folder.
    """
    try:
        status = manifest.stat()
    except OSError:
        return None
    if not S_ISREG(status.st_mode):
        return None
    changed_ns = status.st_mtime_ns if status.st_mtime_ns < newest_trusted_ns else 0
    return CrawledPackage(os.path.basename(os.path.abspath(folder)), folder, changed_ns, DRY)


def _without_comments(manifest: bytes) -> bytes:
    parts = manifest.split(b"<!--")
    for number, part in enumerate(parts[1:], 1):
        _, closing, after = part.partition(b"-->")
        parts[number] = after if closing else part
    return b"".join(parts)


def _name_in(manifest: bytes) -> str:
    """Return the first `<name>` that consists of one word, or an empty string if there is none."""
    for part in manifest.split(b"<name>")[1:]:
        text, closing, _ = part.partition(b"</name>")
        words = text.split()
        if closing and len(words) == 1 and not (b"<" in text or b">" in text):
            return words[0].decode("utf-8", "replace")
    return ""


def dump(found: Crawl) -> str | None:
    """Return a crawl as text for a cache file, or None if a path or name contains a tab or a newline."""
    texts = [found.root, *(path for path, _ in found.folders)]
    texts += [text for package in found.packages for text in (package.path, package.name)]
    if any("\t" in text or "\n" in text for text in texts):
        return None
    lines = [str(len(found.folders)), found.root]
    lines += [f"{changed_ns}\t{path}" for path, changed_ns in found.folders]
    lines += [
        f"{package.manifest_ns}\t{package.path}\t{package.name}\t{package.kind}" for package in found.packages
    ]
    return "\n".join(lines) + "\n"


def load(text: str, root: str) -> Crawl | None:
    """Return the crawl that `dump` wrote, or None if the text is damaged or belongs to another folder."""
    try:
        count, written_root, *lines = text.removesuffix("\n").split("\n")
        if written_root != root:
            return None
        folders = []
        for line in lines[: int(count)]:
            changed_ns, path = line.split("\t")
            folders.append((path, int(changed_ns)))
        packages = []
        for line in lines[int(count) :]:
            changed_ns, path, name, kind = line.split("\t")
            packages.append(CrawledPackage(name, path, int(changed_ns), kind))
    except ValueError:
        return None
    return Crawl(root, tuple(folders), tuple(packages))
