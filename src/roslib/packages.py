"""`roslib.packages`, for old scripts: where packages, their folders, programs and files are.

New code uses `rospkg`, or `pipros.workspace`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from rospkg import ResourceNotFound

from pipros.workspace.executables import find_executables
from pipros.workspace.index import Package, PackageIndex
from pipros.workspace.overlays import built_workspaces

__all__ = [
    "InvalidROSPkgException",
    "MultipleNodesException",
    "ROSPkgException",
    "find_node",
    "find_resource",
    "get_dir_pkg",
    "get_pkg_dir",
    "get_pkg_subdir",
    "resource_file",
]


class ROSPkgException(Exception):
    """A package is not what it should be."""


class InvalidROSPkgException(ROSPkgException):
    """There is no such package, or a part of it is missing."""


class MultipleNodesException(ROSPkgException):
    """A name stands for several programs. Nothing here raises it; old scripts catch it."""


def get_pkg_dir(package: str, required: bool = True) -> str | None:
    """The folder of a package; None when there is none and it is not `required`.

    Raises:
        InvalidROSPkgException: there is none.
    """
    found = PackageIndex.from_environment().get(package)
    if found is not None:
        return str(found.path)
    if required:
        raise InvalidROSPkgException(f"Cannot locate installation of package {package}")
    return None


def get_pkg_subdir(package: str, subdir: str, required: bool = True) -> str | None:
    """A folder in a package; one that is `required` and does not exist is made.

    Raises:
        InvalidROSPkgException: there is no such package, or the folder cannot be made.
    """
    folder = get_pkg_dir(package, required)
    if folder is None:
        return None
    wanted = os.path.join(folder, subdir)
    if os.path.isdir(wanted):
        return wanted
    if not required:
        return None
    try:
        os.makedirs(wanted)
    except OSError as error:
        raise InvalidROSPkgException(
            f"Package '{package}' is improperly configured: subdirectory {wanted} is missing "
            f"and cannot be made ({error.strerror})"
        ) from error
    return wanted


def resource_file(package: str, subdir: str, resource_name: str) -> str:
    """The path that a file in a folder of a package has, or would have.

    Raises:
        InvalidROSPkgException: there is no such package or folder.
    """
    folder = get_pkg_subdir(package, subdir, required=False)
    if folder is None:
        raise InvalidROSPkgException(f"Package '{package}' has no subdirectory '{subdir}'")
    return os.path.join(folder, resource_name)


def get_dir_pkg(d: str) -> tuple[str, str] | tuple[None, None]:
    """Folder and name of the package that a folder lies in; two times None when it lies in none."""
    package = PackageIndex.from_environment().containing(Path(d))
    return (str(package.path), package.name) if package else (None, None)


def find_node(pkg: str, node_type: str) -> list[str]:
    """The programs of that name in a package, built ones first.

    Raises:
        rospkg.ResourceNotFound: there is no such package.
    """
    return [str(path) for path in find_executables(_package(pkg), node_type).runnable]


def find_resource(pkg: str, resource_name: str, filter_fn: Callable[[str], bool] | None = None) -> list[str]:
    """All files of that name in a package and in what was built of it, if `filter_fn` takes them.

    Raises:
        rospkg.ResourceNotFound: there is no such package.
    """
    package = _package(pkg)
    builds = [workspace.executables_of(pkg) for workspace in built_workspaces()]
    found: list[str] = []
    for folder in (*builds, package.path):
        for here, folders, files in os.walk(folder, followlinks=False):
            folders[:] = sorted(name for name in folders if not name.startswith("."))
            path = os.path.join(here, resource_name)
            is_taken = resource_name in files and (filter_fn is None or filter_fn(path))
            if is_taken and path not in found:
                found.append(path)
    return found


def _package(name: str) -> Package:
    index = PackageIndex.from_environment()
    package = index.get(name)
    if package is None:
        raise ResourceNotFound(name, ros_paths=[str(folder) for folder in index.folders])
    return package
