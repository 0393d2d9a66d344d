"""Find the ROS packages that Debian installs.

Their manifests are in `/usr/share/NAME`, and their programs in `/usr/lib/NAME`. No variable needs
to be set: Debian's rospack and rospkg search `/usr/share` after `ROS_PACKAGE_PATH`, one level deep. In
pipros, Debian's packages have lower precedence than the shipped packages, even if `ROS_PACKAGE_PATH` lists
`/usr/share`; otherwise they would hide the shipped packages. Some of Debian's packages have programs without
a manifest, because the manifest belongs to a `-dev` package.

The first import of a message in every process runs this module, so it imports little.
"""

from __future__ import annotations

import os
from stat import S_ISREG

from pipros.basics.windows import ON_WINDOWS

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` takes milliseconds
if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

SYSTEM_SHARE = "/usr/share"
"""Folder with a subfolder for each package that has a manifest."""

PROGRAM_FOLDER = "/usr/lib"
"""Folder with a subfolder for each package that has programs."""

# A program linked with roscpp contains the library's name near its start, in the list of needed libraries.
_LIBRARY = b"libroscpp.so"
_LIBRARY_WITHIN_BYTES = 128 * 1024
_ELF = b"\x7fELF"


def listed_folders(folders: Iterable[str], shipped: Collection[str]) -> list[str]:
    """Return the folders on `ROS_PACKAGE_PATH` without those that are searched later in any case.

    These are Debian's folder and, if they are the last other ones, pipros's, which setup files append.
    """
    first = [folder for folder in folders if not is_share_folder(folder)]
    known = {os.path.realpath(each) for each in shipped}
    while first and first[-1].rstrip("/") in known:
        del first[-1]
    return first


def in_search_order(folders: Iterable[str], installed: Iterable[str], shipped: Collection[str]) -> list[str]:
    """Return the folders to search for packages.

    The folders on `ROS_PACKAGE_PATH` come first, then the folders of packages that pip installed, pipros's
    folders, and Debian's, which Windows does not have.

    Args:
        folders: the folders on `ROS_PACKAGE_PATH`; see `listed_folders`.
        installed: the share folders of installed packages.
        shipped: the folders of the packages shipped with pipros and its plugins.
    """
    system = [] if ON_WINDOWS else [SYSTEM_SHARE]
    return [*listed_folders(folders, shipped), *installed, *shipped, *system]


def is_share_folder(folder: str) -> bool:
    """Return whether a path is that of the folder with Debian's manifests."""
    return folder.rstrip("/") == SYSTEM_SHARE


def manifest_folder(name: str) -> str:
    """Return the folder in which the manifest of Debian's package `name` would be."""
    return os.path.join(SYSTEM_SHARE, name)


def has_manifest(name: str) -> bool:
    """Return whether Debian's package `name` has a manifest."""
    return not ON_WINDOWS and os.path.exists(os.path.join(manifest_folder(name), "package.xml"))


def manifest_folders() -> Iterator[str]:
    """Yield the folders of Debian's packages that have a manifest, sorted."""
    try:
        names = sorted(os.listdir(SYSTEM_SHARE))
    except OSError:
        return
    for name in names:
        if has_manifest(name):
            yield manifest_folder(name)


def has_program_folder(name: str) -> bool:
    """Return whether `/usr/lib/NAME` contains a program that is linked with roscpp.

    Other folders belong to other software, and are not treated as packages.
    """
    return name.isidentifier() and any(map(_uses_roscpp, programs(name)))


def names_without_manifest() -> Iterator[str]:
    """Yield the names of packages that have programs (`has_program_folder`) but no manifest, unsorted."""
    try:
        names = [name for name in os.listdir(PROGRAM_FOLDER) if name.isidentifier()]
    except OSError:
        return
    for name in names:
        if not os.path.exists(os.path.join(manifest_folder(name), "package.xml")) and has_program_folder(
            name
        ):
            yield name


def program(package: str, name: str) -> str | None:
    """Return the path of a program in `/usr/lib/PACKAGE`, or None. Subfolders are not searched."""
    if not package.isidentifier() or os.path.basename(name) != name:
        return None
    path = os.path.join(PROGRAM_FOLDER, package, name)
    return path if _is_program(path) else None


def programs(package: str) -> list[str]:
    """Return the paths of the programs in `/usr/lib/PACKAGE`, sorted."""
    folder = os.path.join(PROGRAM_FOLDER, package)
    try:
        names = sorted(os.listdir(folder)) if package.isidentifier() else []
    except OSError:
        return []
    return [path for name in names if _is_program(path := os.path.join(folder, name))]


def _is_program(path: str) -> bool:
    try:
        return S_ISREG(os.stat(path).st_mode) and os.access(path, os.X_OK)
    except (OSError, ValueError):  # ValueError: the name contains a null character
        return False


def is_compiled(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is a compiled program in the ELF format, not a script."""
    return _start(path, len(_ELF)) == _ELF


def _uses_roscpp(path: str) -> bool:
    start = _start(path, _LIBRARY_WITHIN_BYTES)
    return start.startswith(_ELF) and _LIBRARY in start


def _start(path: str | os.PathLike[str], size: int) -> bytes:
    try:
        with open(path, "rb") as file:
            return file.read(size)
    except OSError:
        return b""


def child_package_path(path: str, shipped: Collection[str], installed: Sequence[str] = ()) -> str:
    """Return a `ROS_PACKAGE_PATH` with which a compiled program finds Debian's packages.

    Genuine roscpp, pluginlib and nodelet read descriptions of plugins from the manifests. pipros's packages
    lack these descriptions, so Debian's folder precedes pipros's, after the other folders.

    Args:
        path: the value that the program would inherit.
        shipped: the folders of the packages shipped with pipros and its plugins.
        installed: the folders of the packages that pip installed, which precede Debian's.
    """
    folders = [folder for folder in path.split(os.pathsep) if folder]
    known = {os.path.realpath(each) for each in shipped}
    place = next((at for at, folder in enumerate(folders) if os.path.realpath(folder) in known), len(folders))
    first = folders[:place]
    added = [*installed, *([] if any(map(is_share_folder, first)) else [SYSTEM_SHARE])]
    return os.pathsep.join([*first, *added, *folders[place:]]) if added else path
