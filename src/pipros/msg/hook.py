"""Imports `<package>.msg` and `<package>.srv` straight from definition files.

Two finders work together. `PackageFinder` stands at the end of `sys.meta_path`: when nobody else
knows the module `my_pkg`, the ROS package `my_pkg` is it. `InterfaceFinder` stands at the front and
answers for `my_pkg.msg` and `my_pkg.srv` alone: a folder `my_pkg/msg` full of definitions below the
current directory would otherwise pass for a Python namespace package. Real Python packages, such as
those that catkin generated into a devel space, always win.

Modules are filled by `modules.py` when the first type is asked for. This module lies on the way of
every interpreter start, so it imports next to nothing.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False  # as type checkers see it; `typing` itself would take milliseconds
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

    from pipros.msg.files import FindPackage
    from pipros.msg.library import Library

KINDS = ("msg", "srv")
NEVER_PACKAGES = frozenset(("pipros", "sitecustomize", "usercustomize", "org", "java"))
"""Names that Python and its library try to import at every start, mostly in vain, and our own."""


def install(find_package: FindPackage, *, cache_folder: str | None = None) -> None:
    """Makes the packages that `find_package` finds importable; the first call counts.

    Args:
        cache_folder: where compiled types are kept between processes; None for nowhere.
    """
    if not any(isinstance(finder, InterfaceFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, InterfaceFinder(find_package, cache_folder))
        sys.meta_path.append(PackageFinder(find_package))


def installed_library() -> Library:
    """The types that imports are made from.

    Raises:
        RuntimeError: before `install`.
    """
    for finder in sys.meta_path:
        if isinstance(finder, InterfaceFinder):
            return finder.library
    raise RuntimeError("pipros.msg.hook.install() was not called")


class PackageFinder:
    """Finds the Python package of a ROS package: its own modules below `src/`, or just its messages."""

    def __init__(self, find_package: FindPackage) -> None:
        self._find_package = find_package

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not _may_be_package(name):
            return None
        found = self._find_package(name)
        if found is None:
            return None
        folder = os.fspath(found)
        from importlib.machinery import ModuleSpec

        modules = os.path.join(folder, "src", name)
        init = os.path.join(modules, "__init__.py")
        if os.path.isfile(init):
            from importlib.util import spec_from_file_location

            return spec_from_file_location(name, init, submodule_search_locations=[modules])
        if any(os.path.isdir(os.path.join(folder, kind)) for kind in (*KINDS, "action")):
            spec = ModuleSpec(name, None, is_package=True)
            spec.submodule_search_locations = [modules]
            return spec
        return None


class InterfaceFinder:
    """Finds `<package>.msg`, `<package>.srv` and the modules of single types in them."""

    def __init__(self, find_package: FindPackage, cache_folder: str | None) -> None:
        self._find_package = find_package
        self._cache_folder = cache_folder
        self._library: Library | None = None

    @property
    def library(self) -> Library:
        if self._library is None:
            from pipros.msg.library import Library

            self._library = Library(self._find_package, self._cache_folder)
        return self._library

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        package, _, rest = name.partition(".")
        kind, _, type_module = rest.partition(".")
        if kind not in KINDS or (type_module and type_module[0] != "_") or not _may_be_package(package):
            return None
        from pipros.msg.modules import interface_spec, type_spec

        if type_module:
            return type_spec(self.library, package, kind, type_module)
        return interface_spec(self.library, package, kind, path)


def _may_be_package(name: str) -> bool:
    return (
        name.isidentifier()
        and name[0] != "_"
        and name not in NEVER_PACKAGES
        and name not in sys.stdlib_module_names
    )
