"""Runs at every start of a Python interpreter that has pipros installed (by `pipros.pth`).

It makes the messages of ROS packages importable and does nothing else. It must cost next to
nothing, so the package index is only imported when an import that nobody else resolved bears the
name of no package that ships with pipros.
"""

from __future__ import annotations

import os

from pipros.msg.hook import install

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pipros.workspace.index import PackageIndex

_SHARE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "share")


class _Packages:
    """Finds the folder of a package on `ROS_PACKAGE_PATH`, as it is now, and in `share/`."""

    def __init__(self) -> None:
        self._path = ""
        self._index: PackageIndex | None = None

    def find(self, name: str) -> str | None:
        path = os.environ.get("ROS_PACKAGE_PATH", "")
        if not path:
            folder = os.path.join(_SHARE, name)
            return folder if os.path.isdir(folder) else None
        if self._index is None or path != self._path:
            from pipros.workspace.index import PackageIndex

            self._path, self._index = path, PackageIndex.from_environment()
        package = self._index.get(name)
        return None if package is None else str(package.path)


def _cache_folder() -> str:
    """Where `pipros.env` would put it; that module is too much for every start of Python."""
    home = os.environ.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
    return os.path.join(home, "pipros", "messages")


install(_Packages().find, cache_folder=_cache_folder())
