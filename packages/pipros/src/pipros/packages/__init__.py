"""Find ROS packages on `ROS_PACKAGE_PATH`, installed by pip, shipped with pipros, or installed by Debian.

Every failed import in the environment uses this module, so it imports almost nothing.
"""

from __future__ import annotations

import os
import sys

from pipros.basics.windows import is_as_written

TYPE_CHECKING = False  # Type checkers treat this as True. Importing `typing` would take milliseconds.
if TYPE_CHECKING:
    from pipros.packages.package_folders import PackageFolders
    from pipros.packages.setup_modules import SetupModules

_CORE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def cache_folder(name: str) -> str:
    """Return the path of a cache folder below `ROS_HOME`, without the slow import of `pipros.basics.env`."""
    home = os.path.expanduser(os.environ.get("ROS_HOME") or "~/.ros")
    if home.startswith("~"):
        from pipros.basics.home import expanded

        home = expanded(home)
    return os.path.join(home, "pipros", name)


def _shares() -> tuple[str, ...]:
    """Return the folders of the shipped packages, unpacked if a zip file contains them."""
    from pipros.basics.plugin_folders import plugin_folders

    found = []
    for folder in (_CORE, *plugin_folders().values()):
        share = os.path.join(folder, "share")
        if not os.path.isdir(folder):
            from pipros.packages.zipped import unpacked

            share = unpacked(share, cache_folder("zipped"))
        if folder == _CORE or os.path.isdir(share):
            found.append(share)
    return tuple(found)


def shipped_folder(name: str) -> str | None:
    """Return the folder of a package that pipros or a plugin ships, or None."""
    for share in SHARES:
        folder = os.path.join(share, name)
        if os.path.isdir(folder):
            return folder
    return None


def is_shipped(package: str) -> bool:
    """Return whether a package's folder is one that pipros or a plugin ships."""
    return os.path.dirname(package) in SHARES


def folder_of_modules(name: str, package: str) -> str | None:
    """Return the folder of the Python package that a ROS package has in `src`, or None.

    Those of shipped packages are on `sys.path`, where ROS 2's package of the same name may come before them.
    """
    folders = [os.path.join(package, "src", name)]
    if is_shipped(package):
        folders += [os.path.join(entry, name) for entry in sys.path]
    for folder in folders:
        if os.path.isfile(os.path.join(folder, "__init__.py")) and (
            folder == folders[0] or os.path.isfile(os.path.join(folder, "py.typed"))
        ):
            return folder
    return None


def has_only_messages(folder: str) -> bool:
    """Return whether a Python package consists of messages and services, as those that pipros ships do."""
    names = os.listdir(folder)
    modules = [name for name in names if name.endswith(".py") and name != "__init__.py"]
    return "__init__.pyi" in names and not modules


SHARES = _shares()
"""The folders of the packages that are shipped: pipros's, then those of the installed plugins."""

SHARE = SHARES[0]
"""The folder of the packages shipped with pipros."""


class ImportablePackages:
    """Finds package folders by name. `ROS_PACKAGE_PATH` is read on each call."""

    def __init__(self) -> None:
        self._path = ""
        self._folders: PackageFolders | None = None
        self._modules: SetupModules | None = None
        self._names: tuple[str, frozenset[str]] = ("", frozenset())

    def find(self, name: str) -> str | None:
        """Return a package's folder, or None.

        The order of precedence is: `ROS_PACKAGE_PATH`, packages that pip installed, pipros's packages,
        Debian's packages.
        """
        from pipros.packages import installed_packages

        path = os.environ.get("ROS_PACKAGE_PATH", "")
        found = self._on_path(path).get(name) if path else None
        if found is None:
            found = installed_packages.find(name)
        if found is None and name.isidentifier():
            shipped = shipped_folder(name)
            found = shipped if shipped and is_as_written(shipped) else None
            if found is None:
                from pipros.packages.system_packages import SYSTEM_SHARE, has_manifest

                if has_manifest(name):
                    from pipros.packages.package_folders import PackageFolders

                    found = PackageFolders([SYSTEM_SHARE]).get(name)
        return found

    def find_module(self, name: str, package: str | None) -> str | None:
        """Return the path of the module or Python package `name`, or None if no `setup.py` declares it.

        Args:
            package: the folder of the only package whose `setup.py` is read; None for all packages on
                `ROS_PACKAGE_PATH` and those that pip installed as editable.
        """
        from pipros.packages import installed_packages

        path = os.environ.get("ROS_PACKAGE_PATH", "")
        editable = list(installed_packages.editable_folders()) if package is None else []
        if package is None and not path and not editable:
            return None
        if self._modules is None:
            from pipros.packages.setup_modules import SetupModules

            self._modules = SetupModules()
        on_path = self._on_path(path).by_name().values() if path and package is None else ()
        return self._modules.find(name, (*on_path, *editable) if package is None else (package,))

    def find_in_workspace(self, name: str, package: str) -> str | None:
        """Return the path of the Python package or module `name` in the ROS package `package`, or None.

        Only packages on `ROS_PACKAGE_PATH` are considered. Their names are listed again only if the variable
        changes.
        """
        folder = self.find_hiding(package)
        if folder is None:
            return None
        modules = os.path.join(folder, "src", name)
        if os.path.isfile(os.path.join(modules, "__init__.py")):
            return modules
        return self.find_module(name, folder)

    def find_hiding(self, package: str) -> str | None:
        """Return the folder of a package on `ROS_PACKAGE_PATH`, or None if no such package is listed there.

        The package hides packages with the same name in all other places.
        """
        path = os.environ.get("ROS_PACKAGE_PATH", "")
        if not path:
            return None
        if self._names[0] != path:
            self._names = path, frozenset(self._on_path(path).by_name())
        return self._on_path(path).get(package) if package in self._names[1] else None

    def _on_path(self, path: str) -> PackageFolders:
        if self._folders is None or path != self._path:
            from pipros.packages.package_folders import PackageFolders
            from pipros.packages.system_packages import listed_folders

            roots = listed_folders(filter(None, path.split(os.pathsep)), SHARES)
            self._path, self._folders = path, PackageFolders(roots, cache_folder("packages"))
        return self._folders
