"""`roslib.launcher`, which made packages importable in rosbuild times. Now they always are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipros.basics.lazy_names import star_names as _star_names

if TYPE_CHECKING:
    from rospkg import RosPack

    from pipros.workspace.index import Package

_star_names(__name__, "os rospkg sys")


def load_manifest(package_name: str, bootstrap_version: str = "0.7") -> None:
    """Checks that a package exists. Its Python modules are importable without this call.

    Raises:
        rospkg.ResourceNotFound: it does not exist.
    """
    del bootstrap_version
    find_package(package_name)


def find_package(name: str) -> Package:
    """The package of that name.

    Raises:
        rospkg.ResourceNotFound: it does not exist.
    """
    from pipros.workspace.index import PackageIndex

    index = PackageIndex.from_environment()
    package = index.get(name)
    if package is None:
        from rospkg import ResourceNotFound  # slow to import, and rarely needed

        raise ResourceNotFound(str(name), ros_paths=[str(folder) for folder in index.folders])
    return package


def get_depends(package: str, rospack: RosPack) -> list[str]:
    """All packages that a package depends on, directly or not."""
    depends: list[str] = rospack.get_depends(package, implicit=True)
    return depends
