"""Find the ROS packages that pip installed.

A wheel of a ROS package installs `share/NAME` beside the Python modules: below the prefix of a
`site-packages` folder on `sys.path` (in the environment, system-wide or in the user's home), or below a
`--target` folder on `sys.path`. Folders are searched in the order of `sys.path`, so that a package and its
modules come from the same installation.

An editable installation instead has one file, `share/pipros/editable/NAME`, with the path of the package's
source folder. The file `share/pipros/modules/MODULE` contains the name of the package to which a top-level
Python module belongs. ROS 2 also installs packages to `share/NAME`; these are ignored.

The first import of a message in every process runs this module, so it imports little. Finding a package takes
two system calls per folder, regardless of the number of installed packages.
"""

from __future__ import annotations

import os
import sys

from pipros.basics.windows import is_as_written
from pipros.packages.system_packages import is_share_folder

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` takes milliseconds
if TYPE_CHECKING:
    from collections.abc import Iterator

EDITABLE = os.path.join("pipros", "editable")
"""Subfolder of a share folder: for each editable package, a file with the path of its source folder."""

MODULES = os.path.join("pipros", "modules")
"""Subfolder of a share folder: for each top-level Python module, a file with the name of its package."""

AMENT_INDEX = os.path.join("ament_index", "resource_index", "packages")
"""Subfolder of a share folder in which ROS 2 has a file for each package."""

_SITE_FOLDERS = ("site-packages", "dist-packages")
_MANIFEST = "package.xml"
_LIMIT_BYTES = 4096
_MANIFEST_BYTES = 1024 * 1024

_known: dict[tuple[str, ...], tuple[str, ...]] = {}


def share_folders() -> tuple[str, ...]:
    """Return the folders with installed packages, in the order of `sys.path`. Debian's folder is left out."""
    path = tuple(sys.path)
    known = _known.get(path)
    if known is None:
        _known.clear()
        candidates = dict.fromkeys(filter(None, map(_share_of, path)))
        known = _known[path] = tuple(folder for folder in candidates if os.path.isdir(folder))
    return known


def _share_of(entry: str) -> str:
    """Return the share folder that belongs to an entry of `sys.path`, or an empty string."""
    parent, name = os.path.split(entry.rstrip(os.sep))
    if name not in _SITE_FOLDERS:
        return os.path.join(entry, "share") if os.path.isabs(entry) else ""
    library, version = os.path.split(parent)
    if version.lower() == "lib":  # on Windows
        prefix = library
    elif version.startswith("python3."):
        prefix = os.path.dirname(library)
    else:
        return ""  # `lib/python3` belongs to Debian, or to a workspace, which `ROS_PACKAGE_PATH` lists
    share = os.path.join(prefix, "share")
    return "" if is_share_folder(share) else share


def is_installed_share(folder: str) -> bool:
    """Return whether a folder is one of `share_folders()`."""
    return folder in share_folders()


def find(name: str) -> str | None:
    """Return the folder of the installed package `name`, or None."""
    for share in share_folders():
        folder = find_in(share, name)
        if folder is not None:
            return folder
    return None


def find_in(share: str, name: str) -> str | None:
    """Return the folder of the package `name` that is installed in one share folder, or None."""
    if os.path.basename(name) != name or not name.isprintable():
        return None
    folder = os.path.join(share, name)
    if os.path.isfile(os.path.join(folder, _MANIFEST)) and is_as_written(folder) and not is_of_ros2(folder):
        return folder
    return _text(os.path.join(share, EDITABLE, name)) or None


def find_of_ros2(name: str) -> str | None:
    """Return the folder of the installed package `name` if it was built for ROS 2, otherwise None."""
    folders = (os.path.join(share, name) for share in share_folders())
    return next((folder for folder in folders if is_of_ros2(folder)), None)


def is_of_ros2(folder: str) -> bool:
    """Return whether an installed package was built for ROS 2: it is in ament's index, or ament builds it."""
    share, name = os.path.split(folder)
    if os.path.exists(os.path.join(share, AMENT_INDEX, name)):
        return True
    try:
        with open(os.path.join(folder, _MANIFEST), "rb") as manifest:
            return b"<build_type>ament_" in manifest.read(_MANIFEST_BYTES)
    except OSError:
        return False


def folders_in(share: str) -> Iterator[str]:
    """Yield the folders of the packages that are installed in one share folder, sorted by name."""
    editable = os.path.join(share, EDITABLE)
    for name in sorted({*_names(share), *_names(editable)}):
        folder = find_in(share, name)
        if folder is not None:
            yield folder


def folders() -> Iterator[str]:
    """Yield the folders of all installed packages. The first of several with the same name has precedence."""
    for share in share_folders():
        yield from folders_in(share)


def editable_folders() -> Iterator[str]:
    """Yield the source folders of the packages with an editable installation."""
    for share in share_folders():
        for name in _names(os.path.join(share, EDITABLE)):
            folder = find_in(share, name)
            if folder is not None:
                yield folder


def modules() -> dict[str, str]:
    """Map each top-level Python module that a wheel installed to the name of its ROS package."""
    found: dict[str, str] = {}
    for share in share_folders():
        folder = os.path.join(share, MODULES)
        for name in _names(folder):
            package = _text(os.path.join(folder, name))
            if package:
                found.setdefault(name, package)
    return found


def programs_folder(package_folder: str) -> str | None:
    """Return the folder for the programs of a package that pip installed, or None for other packages.

    The folder need not exist.
    """
    share, name = os.path.split(package_folder)
    return os.path.join(os.path.dirname(share), "lib", name) if is_installed_share(share) else None


def _names(folder: str) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:
        return []


def _text(file: str) -> str:
    try:
        with open(file, encoding="utf-8") as opened:
            return opened.read(_LIMIT_BYTES).strip()
    except (OSError, UnicodeDecodeError, ValueError):  # ValueError: the name contains a null character
        return ""
