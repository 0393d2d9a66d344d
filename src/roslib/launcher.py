"""`roslib.launcher`: made packages importable in rosbuild times. They are without it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rospkg import RosPack

    from pipros.workspace.index import Package


def load_manifest(package_name: str, bootstrap_version: str = "0.7") -> None:
    """Checks that there is such a package: its Python modules need nothing to be importable.

    Raises:
        rospkg.ResourceNotFound: there is none.
    """
    del bootstrap_version
    find_package(package_name)


def find_package(name: str) -> Package:
    """The package of that name.

    Raises:
        rospkg.ResourceNotFound: there is none.
    """
    from pipros.workspace.index import PackageIndex

    index = PackageIndex.from_environment()
    package = index.get(name)
    if package is None:
        from rospkg import ResourceNotFound  # takes longer to import than all that old scripts need

        raise ResourceNotFound(str(name), ros_paths=[str(folder) for folder in index.folders])
    return package


def get_depends(package: str, rospack: RosPack) -> list[str]:
    """The packages that a package needs, and those that they need."""
    depends: list[str] = rospack.get_depends(package, implicit=True)
    return depends
