"""`roslib.resources`: the files in a package's folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from roslib.launcher import find_package

Filter = Callable[[str], object]


def list_package_resources(
    package: str, include_depends: bool, subdir: str, rfilter: Filter | None = None
) -> list[str]:
    """Return the names of the files in one of a package's folders.

    If `include_depends` is true, include the files in the package's dependencies. `rfilter` is called with
    the path of each file and returns whether to include it.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    from roslib.packages import get_pkg_dir

    folders = [str(get_pkg_dir(package))]
    if include_depends:
        from rospkg import RosPack

        folders += [str(find_package(name).path) for name in RosPack().get_depends(package, implicit=False)]
    return [
        name for folder in folders for name in list_package_resources_by_dir(folder, False, subdir, rfilter)
    ]


def list_package_resources_by_dir(
    package_dir: str, include_depends: bool, subdir: str, rfilter: Filter | None = None
) -> list[str]:
    """Like `list_package_resources`, for the package in the folder `package_dir`."""
    if include_depends:
        return list_package_resources(Path(package_dir).name, True, subdir, rfilter)
    folder = Path(package_dir, subdir)
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    return [file.name for file in files if file.is_file() and (rfilter is None or rfilter(str(file)))]
