"""Shows `rospkg` the packages that come with pipros, in every process of the environment.

rospkg looks only where `ROS_ROOT` and `ROS_PACKAGE_PATH` point to. To set these for every start of Python
would reach the programs that it starts, too, so the answer of rospkg's own function is made longer instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType

MODULE = "rospkg.environment"


class _Loader(SourceFileLoader):
    """Loads that module, and puts a folder behind those that it finds packages in."""

    def __init__(self, name: str, path: str, folder: str) -> None:
        super().__init__(name, path)
        self._folder = folder

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        original: Callable[[Mapping[str, str] | None], list[str]] = module.get_ros_paths
        folder = self._folder

        def get_ros_paths(env: Mapping[str, str] | None = None) -> list[str]:
            """The folders in which rospkg looks for packages, those that come with pipros last."""
            paths = original(env)
            return paths if folder in paths else [*paths, folder]

        module.get_ros_paths = get_ros_paths  # type: ignore[attr-defined]


def spec(path: Sequence[str] | None, folder: str) -> ModuleSpec | None:
    """How to import the module from `path`, with `folder` in what it answers; None when it is not there."""
    found = PathFinder.find_spec(MODULE, path)
    if found is not None and type(found.loader) is SourceFileLoader:
        found.loader = _Loader(MODULE, found.loader.path, folder)
    return found
