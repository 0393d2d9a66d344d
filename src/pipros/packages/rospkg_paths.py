"""Makes `rospkg` find the packages shipped with pipros, in every process of the environment.

rospkg searches only the folders of `ROS_ROOT` and `ROS_PACKAGE_PATH`. If these were set at every start of
Python, its child processes would inherit them. Instead, rospkg's function that lists the folders returns one
more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType

MODULE = "rospkg.environment"


class _Loader(SourceFileLoader):
    """Loads `rospkg.environment`, and appends a folder to those that rospkg searches."""

    def __init__(self, name: str, path: str, folder: str) -> None:
        super().__init__(name, path)
        self._folder = folder

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        original: Callable[[Mapping[str, str] | None], list[str]] = module.get_ros_paths
        folder = self._folder

        def get_ros_paths(env: Mapping[str, str] | None = None) -> list[str]:
            """Return the folders that rospkg searches for packages, with that of pipros last."""
            paths = original(env)
            return paths if folder in paths else [*paths, folder]

        module.get_ros_paths = get_ros_paths  # type: ignore[attr-defined]


def spec(path: Sequence[str] | None, folder: str) -> ModuleSpec | None:
    """Return the spec of the module in `path`, extended to search `folder`; None if there is no module."""
    found = PathFinder.find_spec(MODULE, path)
    if found is not None and type(found.loader) is SourceFileLoader:
        found.loader = _Loader(MODULE, found.loader.path, folder)
    return found
