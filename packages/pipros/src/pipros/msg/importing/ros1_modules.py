"""The modules below `pipros.ros1`.

In an environment with ROS 2's wheels, public names such as `std_msgs.msg` belong to ROS 2, unless
`PIPROS_MESSAGES` is `ros1`. Then `pipros.ros1.std_msgs.msg` is a module of its own. Otherwise, it is another
name of `std_msgs.msg`.
"""

from __future__ import annotations

import importlib
import os
import sys
from importlib.machinery import ModuleSpec, PathFinder

from pipros.basics.errors import NotFound
from pipros.msg.importing.beside_ros2 import Ros1Loader
from pipros.msg.importing.modules import InterfaceLoader, TypeLoader, is_ros2_name
from pipros.packages import folder_of_modules

TYPE_CHECKING = False
if TYPE_CHECKING:
    from importlib.abc import Loader
    from types import ModuleType

    from pipros.msg.importing.library import Library
else:
    Loader = object  # Importing importlib.abc would take milliseconds.

PREFIX = "pipros.ros1."
_KINDS = ("msg", "srv")


def ros1_spec(library: Library, name: str) -> ModuleSpec | None:
    """Return the spec of a module below `pipros.ros1`, or None if ROS 1 has no such interfaces."""
    package, *rest = name.removeprefix(PREFIX).split(".")
    kinds = _kinds(library, package)
    if not rest:
        spec = ModuleSpec(name, None, is_package=True)
        spec.submodule_search_locations = []
        return spec if kinds else None
    if not kinds:
        return None
    if not is_ros2_name(package):
        return ModuleSpec(name, _AliasLoader(name.removeprefix(PREFIX)))
    if rest[0] not in kinds:  # such as sensor_msgs.point_cloud2
        folder = folder_of_modules(package, os.fspath(library.files.folder(package)))
        found = PathFinder.find_spec(name, [folder]) if folder is not None and len(rest) == 1 else None
        if found is not None and found.origin:
            found.loader = Ros1Loader(name, found.origin)
        return found
    if len(rest) == 1:
        return ModuleSpec(name, InterfaceLoader(library, package, rest[0]), is_package=True)
    parent = sys.modules[name.rpartition(".")[0]].__loader__
    type_name = rest[1].removeprefix("_")
    if not isinstance(parent, InterfaceLoader) or type_name not in parent.types():
        return None
    return ModuleSpec(name, TypeLoader(library, rest[0], f"{package}/{type_name}"))


def _kinds(library: Library, package: str) -> list[str]:
    """Return the kinds of interfaces that ROS 1 has in a package."""
    kinds = []
    for kind in _KINDS:
        try:
            if library.files.names(kind, package):
                kinds.append(kind)
        except NotFound:
            break
    if not kinds and package.isidentifier():  # a package without definitions, which genpy generated
        try:
            path = None if is_ros2_name(package) else importlib.import_module(package).__path__
        except (ImportError, AttributeError):
            return []
        kinds = [kind for kind in _KINDS if path and PathFinder.find_spec(f"{package}.{kind}", path)]
    return kinds


class _AliasLoader(Loader):
    """Loader that gives a module a second name."""

    def __init__(self, public_name: str) -> None:
        self._public_name = public_name

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:  # noqa: ARG002 # the protocol's
        return None

    def exec_module(self, module: ModuleType) -> None:
        sys.modules[module.__name__] = importlib.import_module(self._public_name)
