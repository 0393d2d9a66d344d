"""Describe all packages with a given name, for `rospack find -v`."""

from __future__ import annotations

from pathlib import Path

from pipros.packages.installed_packages import editable_folders, is_installed_share
from pipros.packages.system_packages import is_share_folder
from pipros.safe.xml import XmlError
from pipros_workspace.index import SHIPPED_FOLDERS, Package, PackageIndex
from pipros_workspace.manifest import read_manifest


def describe_candidates(index: PackageIndex, name: str) -> list[str]:
    """Return a line for each package called `name`: its folder, version and origin.

    The package in the first line is used, and hides the others.
    """
    found = dict.fromkeys(index.candidates(name))
    return [
        f"{package.path}  {_version(package.path)}  {_origin(package)}{', hidden' if number else ''}"
        for number, package in enumerate(found)
    ]


def _version(folder: Path) -> str:
    try:
        return read_manifest(folder).version or "-"
    except (XmlError, OSError):
        return "-"


def _origin(package: Package) -> str:
    parent = package.path.parent
    if parent in SHIPPED_FOLDERS:
        return "pipros"
    if is_share_folder(str(parent)):
        return "Debian"
    if is_installed_share(str(parent)):
        return "pip"
    if str(package.path) in editable_folders():
        return "pip, editable"
    return "ROS_PACKAGE_PATH"
