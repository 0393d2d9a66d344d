"""Runs at every start of a Python interpreter that has pipros installed (by `pipros.pth`).

It makes the messages of ROS packages importable and does nothing else. It must cost next to
nothing, so what looks for packages is only imported when an import that nobody else resolved asks
for one and `ROS_PACKAGE_PATH` is set.
"""

from __future__ import annotations

import os

from pipros.msg.hook import install

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pipros.workspace.folders import PackageFolders

_SHARE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "share")


class _Packages:
    """Finds the folder of a package on `ROS_PACKAGE_PATH`, as it is now, and in `share/`."""

    def __init__(self) -> None:
        self._path = ""
        self._folders: PackageFolders | None = None

    def find(self, name: str) -> str | None:
        path = os.environ.get("ROS_PACKAGE_PATH", "")
        found = self._on_path(path).get(name) if path else None
        if found is None and name.isidentifier():
            shipped = os.path.join(_SHARE, name)
            found = shipped if os.path.isdir(shipped) else None
        return found

    def _on_path(self, path: str) -> PackageFolders:
        if self._folders is None or path != self._path:
            from pipros.workspace.folders import PackageFolders

            roots = [folder for folder in path.split(os.pathsep) if folder]
            self._path, self._folders = path, PackageFolders(roots, _cache_folder("packages"))
        return self._folders


def _cache_folder(name: str) -> str:
    """Where `pipros.env` would put it; that module is too much for every start of Python."""
    home = os.environ.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
    return os.path.join(home, "pipros", name)


install(_Packages().find, cache_folder=_cache_folder("messages"))
