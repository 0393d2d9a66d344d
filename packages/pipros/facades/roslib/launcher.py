"""`roslib.launcher`, for legacy scripts: `load_manifest`, which made packages importable before catkin."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rospkg import RosPack

    from pipros_workspace.index import Package


def load_manifest(package_name: str, bootstrap_version: str = "0.7") -> None:
    """Check that a package exists. Its Python modules are importable without this call.

    Raises:
        rospkg.ResourceNotFound: the package does not exist.
    """
    del bootstrap_version
    find_package(package_name)


def find_package(name: str) -> Package:
    """Return the package called `name`.

    Raises:
        rospkg.ResourceNotFound: the package does not exist.
    """
    from pipros_workspace.index import PackageIndex

    index = PackageIndex.from_environment()
    package = index.get(name)
    if package is None:
        from rospkg import ResourceNotFound  # this module is slow to import and rarely needed

        raise ResourceNotFound(str(name), ros_paths=[str(folder) for folder in index.folders])
    return package


def get_depends(package: str, rospack: RosPack) -> list[str]:
    """Return all direct and indirect dependencies of a package."""
    depends: list[str] = rospack.get_depends(package, implicit=True)
    return depends
