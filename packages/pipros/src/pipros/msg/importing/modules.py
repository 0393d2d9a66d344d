"""The modules that the import hook creates: one for a package's messages or services, and one for each type.

For example, `std_msgs.msg` lists the names of its types, and compiles each type on its first use. As in
packages that genpy generates, the class `String` is defined in `std_msgs.msg._String`. Pickles written with
either kind of package can therefore be read with the other.
"""

from __future__ import annotations

import importlib
import os
import sys
from importlib.machinery import ModuleSpec, PathFinder

from pipros.basics.errors import NotFound
from pipros.msg.compile.run import run

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from importlib.abc import Loader
    from types import ModuleType

    from pipros.msg.importing.library import Library
else:
    Loader = object  # Importing importlib.abc would take milliseconds.


def ros1_module(package: str, kind: str) -> ModuleType:
    """Import `<package>.<kind>`, or `pipros.ros1.<package>.<kind>` if the former is ROS 2's.

    Raises:
        ModuleNotFoundError: the module does not exist.
    """
    name = f"{package}.{kind}"
    known = sys.modules.get(name)
    if known is not None and isinstance(known.__loader__, InterfaceLoader):
        return known
    return importlib.import_module(f"pipros.ros1.{name}" if is_ros2_name(package) else name)


def is_ros2_name(package: str) -> bool:
    """Import a top-level package, and return whether the messages in it are ROS 2's."""
    file = getattr(importlib.import_module(package), "__file__", None)
    return file is not None and not ros1_has_public_names() and is_ros2_folder(os.path.dirname(file))


def ros1_has_public_names() -> bool:
    """Return whether public names belong to ROS 1 where ROS 2's wheels have the same names."""
    return os.environ.get("PIPROS_MESSAGES") == "ros1"


def is_ros2_folder(folder: str) -> bool:
    """Return whether rosidl generated the Python package in a folder: it then has these libraries."""
    try:
        return any("__rosidl_typesupport_" in name for name in os.listdir(folder))
    except OSError:
        return False


def why_not_ros1(value: object) -> str:
    """Return why a class or a message of ROS 2 cannot be used in ROS 1, and what to use instead."""
    cls = value if isinstance(value, type) else type(value)
    home = cls.__module__.rpartition(".")[0]
    file = getattr(sys.modules.get(home), "__file__", None)
    return (
        f"{home}.{cls.__name__} is a class of ROS 2 ({file}), whose packages have the same names in this "
        "environment. Install ROS 2 in an environment of its own, or import ROS 1's class: "
        f"from pipros.ros1.{home} import {cls.__name__}"
    )


def interface_spec(
    library: Library, package: str, kind: str, path: Sequence[str] | None
) -> ModuleSpec | None:
    """Return the spec of `<package>.<kind>` from a Python package or, failing that, from definitions.

    Return None if neither exists.
    """
    name = f"{package}.{kind}"
    regular = PathFinder.find_spec(name, path)
    if regular is not None and regular.loader is not None:
        return regular
    try:
        types = library.files.names(kind, package)
    except NotFound:
        return regular
    if not types:
        return regular
    return ModuleSpec(name, InterfaceLoader(library, package, kind), is_package=True)


def type_spec(library: Library, package: str, kind: str, module: str) -> ModuleSpec | None:
    """Return the spec of `<package>.<kind>._Name`.

    Return None if `<package>.<kind>` was not created from definitions or does not contain the type.
    """
    parent = sys.modules.get(f"{package}.{kind}")
    loader = getattr(parent, "__loader__", None)
    if not isinstance(loader, InterfaceLoader) or module.removeprefix("_") not in loader.types():
        return None
    type_name = f"{package}/{module.removeprefix('_')}"
    return ModuleSpec(f"{package}.{kind}.{module}", TypeLoader(library, kind, type_name))


class InterfaceLoader(Loader):
    """Loader that gives a package's module `__getattr__` and `__dir__` functions for its types.

    `__all__` is computed whenever it is read.
    """

    def __init__(self, library: Library, package: str, kind: str) -> None:
        self._library = library
        self._package = package
        self._kind = kind

    def types(self) -> list[str]:
        """Return the current types, which may change while a program is running."""
        try:
            return self._library.files.names(self._kind, self._package)
        except NotFound:
            return []

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:  # noqa: ARG002 # the protocol's
        return None

    def exec_module(self, module: ModuleType) -> None:
        def get(name: str) -> object:
            homes = self._homes()
            home = homes.get(name)
            if home is None:
                return _imported(module, name, homes)
            value = getattr(importlib.import_module(f"{module.__name__}._{home}"), name)
            setattr(module, name, value)
            return value

        module.__dict__.update(__getattr__=get, __dir__=lambda: sorted({*module.__dict__, *self._homes()}))

    def _homes(self) -> dict[str, str]:
        """Map the names of the package's classes to the types whose modules define them."""
        homes = {name: name for name in self.types()}
        if self._kind == "srv":
            for name in list(homes):
                homes |= {f"{name}Request": name, f"{name}Response": name}
        return homes


class TypeLoader(Loader):
    """Loader that compiles one message or service."""

    def __init__(self, library: Library, kind: str, type_name: str) -> None:
        self._library = library
        self._kind = kind
        self._type = type_name

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:  # noqa: ARG002 # the protocol's
        return None

    def exec_module(self, module: ModuleType) -> None:
        code, embedded = self._library.code(self._kind, self._type)
        for type_name, alias in embedded.items():
            package, _, name = type_name.partition("/")
            module.__dict__[alias] = getattr(ros1_module(package, "msg"), name)
        run(code, module.__dict__)
        classes = [name for name in module.__dict__ if name[0] != "_"]
        module.__dict__["__getattr__"] = lambda name: _imported(module, name, classes)


def _imported(module: ModuleType, name: str, classes: Iterable[str]) -> object:
    """Return `__all__`, or the object that a generated module imports as `name`.

    Called only for names that the module lacks, so a message type hides an import with the same name.
    """
    if name[0] == "_" and name != "__all__":
        raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}")
    from pipros.msg.importing.star_names import imported_name, imported_names

    if name == "__all__":
        found = imported_names(
            [getattr(module, key) for key in classes], lambda package: ros1_module(package, "msg")
        )
        module.__dict__.update({key: value for key, value in found.items() if key not in module.__dict__})
        return sorted({*classes, *found})
    try:
        return imported_name(name)
    except AttributeError:
        raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}") from None
