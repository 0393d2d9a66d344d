"""Make `rospkg` and `pkg_resources` find pipros's packages in every process of the environment.

rospkg searches only the folders in `ROS_ROOT` and `ROS_PACKAGE_PATH`. Setting these variables whenever Python
starts would affect child processes, too. Instead, the function with which rospkg lists these folders is
replaced by one that adds the folder of each package that pip installed, and pipros's folder.

pkg_resources, which is part of old versions of setuptools, reads the metadata files of distributions.
`distributions.py` explains why pipros's packages do not have such files. Instead, the packages are added to
the working set of pkg_resources, where they can be found by name, but are not listed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType
from typing import Any

from pipros.packages import SHARES

Complete = Callable[[Any], None]
"""Function that changes a module that was just loaded."""


class _CompletingLoader(SourceFileLoader):
    """Loader that loads a module and then completes it."""

    def __init__(self, name: str, path: str, complete: Complete) -> None:
        super().__init__(name, path)
        self._complete = complete

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        self._complete(module)


def spec(name: str, path: Sequence[str] | None, complete: Complete | None = None) -> ModuleSpec | None:
    """Return a spec that loads and completes a module, or None if `path` does not contain the module.

    Args:
        name: one of `COMPLETED`.
        complete: defaults to the entry in `COMPLETED`.
    """
    found = PathFinder.find_spec(name, path)
    if found is not None and type(found.loader) is SourceFileLoader:
        found.loader = _CompletingLoader(name, found.loader.path, complete or COMPLETED[name])
    return found


def add_folders(module: Any, shares: Sequence[str] = SHARES) -> None:
    """Make `rospkg.environment.get_ros_paths` add the packages that pip installed, then `shares`."""
    from pipros.packages import installed_packages

    original: Callable[[Mapping[str, str] | None], list[str]] = module.get_ros_paths

    def get_ros_paths(env: Mapping[str, str] | None = None) -> list[str]:
        """Return the folders in which rospkg searches for packages, including `added`."""
        paths = original(env)
        while paths and paths[-1] in shares:  # the setup files of workspaces put them there
            paths = paths[:-1]
        added = [*installed_packages.folders(), *shares]
        return [*paths, *(path for path in added if path not in paths)]

    module.get_ros_paths = get_ros_paths


def add_distributions(module: Any) -> None:
    """Make `pkg_resources` find pipros's packages as well. Installed packages take precedence."""
    from pipros.packages.distributions import shipped_distribution

    for share in SHARES:
        for name in os.listdir(share):
            shipped = shipped_distribution(name)
            if shipped is not None:
                # This location is not on sys.path, so its distributions are not listed.
                folder = os.path.join(share, name)
                found = module.Distribution(folder, project_name=name, version=shipped.version)
                module.working_set.add(found, insert=False)


COMPLETED: Mapping[str, Complete] = {"rospkg.environment": add_folders, "pkg_resources": add_distributions}
"""The completed modules, and the functions that complete them."""
