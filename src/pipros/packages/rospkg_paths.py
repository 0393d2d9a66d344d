"""Makes `rospkg` find the packages that come with pipros, in every process of the environment.

rospkg searches only the folders of `ROS_ROOT` and `ROS_PACKAGE_PATH`. If these were set at every start of
Python, its child processes would inherit them. Instead, the function of rospkg that lists the folders
returns one more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType

MODULE = "rospkg.environment"


class _Loader(SourceFileLoader):
    """Loads that module, and appends a folder to those that it searches."""

    def __init__(self, name: str, path: str, folder: str) -> None:
        super().__init__(name, path)
        self._folder = folder

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        original: Callable[[Mapping[str, str] | None], list[str]] = module.get_ros_paths
        folder = self._folder

        def get_ros_paths(env: Mapping[str, str] | None = None) -> list[str]:
            """Return the folders in which rospkg looks for packages, those that come with pipros last."""
            paths = original(env)
            return paths if folder in paths else [*paths, folder]

        module.get_ros_paths = get_ros_paths  # type: ignore[attr-defined]


def spec(path: Sequence[str] | None, folder: str) -> ModuleSpec | None:
    """Return the spec of the module in `path`, changed to search `folder` too; None if the module is not
    there.
    """
    found = PathFinder.find_spec(MODULE, path)
    if found is not None and type(found.loader) is SourceFileLoader:
        found.loader = _Loader(MODULE, found.loader.path, folder)
    return found
