"""`roslib.packages`, for legacy scripts: search for packages, their folders, programs and files.

New code uses `rospkg`, or `pipros_workspace`.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from subprocess import PIPE as PIPE
from typing import TYPE_CHECKING

from pipros.basics.env import Environment
from pipros_workspace.executables import find_executables
from pipros_workspace.find_in_workspaces import find_in_workspaces as catkin_find
from pipros_workspace.index import Package, PackageIndex
from pipros_workspace.overlays import built_workspaces
from roslib.launcher import find_package

if TYPE_CHECKING:
    from rospkg import RosPack

__all__ = [
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "SRC_DIR",
    "InvalidROSPkgException",
    "MultipleNodesException",
    "ROSPkgException",
    "catkin_find",
    "find_node",
    "find_resource",
    "get_dir_pkg",
    "get_pkg_dir",
    "get_pkg_subdir",
    "list_pkgs_by_path",
    "resource_file",
]

MANIFEST_FILE = "manifest.xml"
PACKAGE_FILE = "package.xml"
SRC_DIR = "src"
ROS_PACKAGE_PATH = "ROS_PACKAGE_PATH"
ROS_ROOT = "ROS_ROOT"


class ROSPkgException(Exception):
    """Base class of errors about packages."""


class InvalidROSPkgException(ROSPkgException):
    """A package does not exist or is incomplete."""


class MultipleNodesException(ROSPkgException):
    """Several programs have the same name. pipros never raises this error; legacy scripts catch it."""


def get_pkg_dir(
    package: str, required: bool = True, ros_root: str | None = None, ros_package_path: str | None = None
) -> str | None:
    """Return a package's folder, or None if the package does not exist and is not `required`.

    `ros_package_path` is used instead of `ROS_PACKAGE_PATH`; `ros_root` is ignored.

    Raises:
        InvalidROSPkgException: the package is `required` and does not exist.
    """
    del ros_root
    environment = Environment.from_os()
    if ros_package_path is not None:
        folders = tuple(Path(folder) for folder in ros_package_path.split(os.pathsep) if folder)
        environment = environment._replace(package_path=folders)
    found = PackageIndex.from_environment(environment).get(package)
    if found is not None:
        return str(found.path)
    if required:
        raise InvalidROSPkgException(f"Cannot locate installation of package {package}")
    return None


def get_pkg_subdir(
    package: str, subdir: str, required: bool = True, env: Mapping[str, str] | None = None
) -> str | None:
    """Return a folder in a package, or None if the folder does not exist and is not `required`.

    A `required` folder is created if it does not exist.

    `ROS_PACKAGE_PATH` is taken from `env` if it is given.

    Raises:
        InvalidROSPkgException: a `required` folder's package does not exist, or the folder cannot be created.
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
            f"and cannot be created ({error.strerror})"
        ) from error
    return wanted


def resource_file(package: str, subdir: str, resource_name: str) -> str:
    """Return the path of a file in one of a package's folders.

    Neither the file nor the folder needs to exist.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    return os.path.join(get_pkg_dir(package) or "", subdir, resource_name)


def get_dir_pkg(d: str) -> tuple[str, str] | tuple[None, None]:
    """Return the folder and name of the package that contains `d`, or `(None, None)` if there is none."""
    package = PackageIndex.from_environment().containing(Path(d))
    return (str(package.path), package.name) if package else (None, None)


def find_node(pkg: str, node_type: str, rospack: RosPack | None = None) -> list[str]:
    """Return the programs with the given name in a package, built programs first.

    If `rospack` is given, it locates the package.

    Raises:
        rospkg.ResourceNotFound: the package does not exist.
    """
    return [str(path) for path in find_executables(_package(pkg, rospack), node_type).runnable]


def find_resource(
    pkg: str,
    resource_name: str,
    filter_fn: Callable[[str], bool] | None = None,
    rospack: RosPack | None = None,
) -> list[str]:
    """Return all files with the given name in a package and among its built programs.

    Only files for which `filter_fn` returns True are included. If `rospack` is given, it locates the package.

    Raises:
        rospkg.ResourceNotFound: the package does not exist.
    """
    package = _package(pkg, rospack)
    builds = [workspace.executables_of(pkg) for workspace in built_workspaces()]
    found = (_find_resource(folder, resource_name, filter_fn) for folder in (*builds, package.path))
    return list(dict.fromkeys(itertools.chain.from_iterable(found)))


def _find_resource(
    d: str | os.PathLike[str], resource_name: str, filter_fn: Callable[[str], bool] | None = None
) -> list[str]:
    """Return all files below a folder that have the given name and for which `filter_fn` returns True.

    Hidden folders, and links that lead back to a parent folder, are skipped. Other packages call this
    function.
    """
    found = []
    for parent, folders, files in os.walk(d, followlinks=True):
        here = os.path.join(os.path.realpath(parent), "")
        folders[:] = sorted(
            name
            for name in folders
            if not (
                name.startswith(".") or here.startswith(os.path.realpath(os.path.join(parent, name)) + os.sep)
            )
        )
        path = os.path.join(parent, resource_name)
        if resource_name in files and (filter_fn is None or filter_fn(path)):
            found.append(os.path.abspath(path))
    return found


def list_pkgs_by_path(
    path: str,
    packages: list[str] | None = None,
    cache: dict[str, str] | None = None,
    env: Mapping[str, str] | None = None,
) -> list[str]:
    """Append the packages below a folder to `packages`, and return the list. Add their folders to `cache`."""
    del env
    found = packages if packages is not None else []
    for package in PackageIndex([Path(path)]):
        if package.name not in found:
            found.append(package.name)
            if cache is not None:
                cache[package.name] = str(package.path)
    return found


def _package(name: str, rospack: RosPack | None) -> Package:
    return find_package(name) if rospack is None else Package(name, Path(rospack.get_path(name)))
