"""`roslib.packages`, for old scripts: where packages, their folders, programs and files are.

New code uses `rospkg`, or `pipros.workspace`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.env import Environment
from pipros.workspace.executables import find_executables
from pipros.workspace.index import Package, PackageIndex
from pipros.workspace.overlays import built_workspaces
from roslib.launcher import find_package

if TYPE_CHECKING:
    from rospkg import RosPack

__all__ = [
    "InvalidROSPkgException",
    "MultipleNodesException",
    "ROSPkgException",
    "find_node",
    "find_resource",
    "get_dir_pkg",
    "get_pkg_dir",
    "get_pkg_subdir",
    "list_pkgs_by_path",
    "resource_file",
]


class ROSPkgException(Exception):
    """A package is not what it should be."""


class InvalidROSPkgException(ROSPkgException):
    """There is no such package, or a part of it is missing."""


class MultipleNodesException(ROSPkgException):
    """A name stands for several programs. Nothing here raises it; old scripts catch it."""


def get_pkg_dir(
    package: str, required: bool = True, ros_root: str | None = None, ros_package_path: str | None = None
) -> str | None:
    """The folder of a package; None when there is none and it is not `required`.

    `ros_package_path` is looked at in place of `ROS_PACKAGE_PATH`; `ros_root` has no meaning any more.

    Raises:
        InvalidROSPkgException: there is none.
    """
    del ros_root
    environment = Environment.from_os()
    if ros_package_path is not None:
        folders = tuple(Path(folder) for folder in ros_package_path.split(os.pathsep) if folder)
        environment = replace(environment, package_path=folders)
    found = PackageIndex.from_environment(environment).get(package)
    if found is not None:
        return str(found.path)
    if required:
        raise InvalidROSPkgException(f"Cannot locate installation of package {package}")
    return None


def get_pkg_subdir(
    package: str, subdir: str, required: bool = True, env: Mapping[str, str] | None = None
) -> str | None:
    """A folder in a package; one that is `required` and does not exist is made.

    `env` is looked at in place of the environment of the process.

    Raises:
        InvalidROSPkgException: there is no such package, or the folder cannot be made.
    """
    folder = get_pkg_dir(
        package, required, ros_package_path=None if env is None else env.get("ROS_PACKAGE_PATH", "")
    )
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
        InvalidROSPkgException: there is no such package.
    """
    return os.path.join(get_pkg_dir(package) or "", subdir, resource_name)


def get_dir_pkg(d: str) -> tuple[str, str] | tuple[None, None]:
    """Folder and name of the package that a folder lies in; two times None when it lies in none."""
    package = PackageIndex.from_environment().containing(Path(d))
    return (str(package.path), package.name) if package else (None, None)


def find_node(pkg: str, node_type: str, rospack: RosPack | None = None) -> list[str]:
    """The programs of that name in a package, built ones first. `rospack` finds the package.

    Raises:
        rospkg.ResourceNotFound: there is no such package.
    """
    return [str(path) for path in find_executables(_package(pkg, rospack), node_type).runnable]


def find_resource(
    pkg: str,
    resource_name: str,
    filter_fn: Callable[[str], bool] | None = None,
    rospack: RosPack | None = None,
) -> list[str]:
    """All files of that name in a package and in what was built of it, if `filter_fn` takes them.

    `rospack` finds the package.

    Raises:
        rospkg.ResourceNotFound: there is no such package.
    """
    package = _package(pkg, rospack)
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


def list_pkgs_by_path(path: str, packages: list[str] | None = None) -> list[str]:
    """The packages below a folder, added to `packages` when that is given."""
    found = packages if packages is not None else []
    found += [package.name for package in PackageIndex([Path(path)]) if package.name not in found]
    return found


def _package(name: str, rospack: RosPack | None) -> Package:
    return find_package(name) if rospack is None else Package(name, Path(rospack.get_path(name)))
