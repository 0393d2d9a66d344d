"""The modules that the import hook makes: one for all messages of a package, one for each type.

`std_msgs.msg` knows the names of its types and compiles a type when it is first needed. The class is in
`std_msgs.msg._String`, as in packages that genpy generates, so that pickles of either world find their class
in the other.
"""

from __future__ import annotations

import importlib
import sys
from importlib.machinery import ModuleSpec, PathFinder

from pipros.errors import NotFound
from pipros.msg.compile.run import run

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.abc import Loader
    from types import ModuleType

    from pipros.msg.importing.library import Library
else:
    Loader = object  # importlib.abc takes milliseconds to import


def interface_spec(
    library: Library, package: str, kind: str, path: Sequence[str] | None
) -> ModuleSpec | None:
    """The spec of `<package>.<kind>`: of a Python package if there is one, else made from the definitions."""
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
    return ModuleSpec(name, _InterfaceLoader(library, package, kind), is_package=True)


def type_spec(library: Library, package: str, kind: str, module: str) -> ModuleSpec | None:
    """The spec of `<package>.<kind>._Name`; None if `<package>.<kind>` was not made from definitions."""
    parent = sys.modules.get(f"{package}.{kind}")
    loader = getattr(parent, "__loader__", None)
    if not isinstance(loader, _InterfaceLoader) or module.removeprefix("_") not in loader.types():
        return None
    type_name = f"{package}/{module.removeprefix('_')}"
    return ModuleSpec(f"{package}.{kind}.{module}", _TypeLoader(library, kind, type_name))


class _InterfaceLoader(Loader):
    """Gives a module `__getattr__`, `__dir__` and `__all__` for the types of its package."""

    def __init__(self, library: Library, package: str, kind: str) -> None:
        self._library = library
        self._package = package
        self._kind = kind

    def types(self) -> list[str]:
        """The types that exist now: definitions and packages may come and go while a program runs."""
        try:
            return self._library.files.names(self._kind, self._package)
        except NotFound:
            return []

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:  # noqa: ARG002 # the protocol's
        return None

    def exec_module(self, module: ModuleType) -> None:
        def get(name: str) -> object:
            home = self._homes().get(name)
            if home is None:
                raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}")
            value = getattr(importlib.import_module(f"{module.__name__}._{home}"), name)
            setattr(module, name, value)
            return value

        module.__dict__.update(
            __getattr__=get,
            __dir__=lambda: sorted({*module.__dict__, *self._homes()}),
            __all__=sorted(self._homes()),
        )

    def _homes(self) -> dict[str, str]:
        """The classes of the package, each with the type in whose module it is."""
        homes = {name: name for name in self.types()}
        if self._kind == "srv":
            for name in list(homes):
                homes |= {f"{name}Request": name, f"{name}Response": name}
        return homes


class _TypeLoader(Loader):
    """Compiles one message or service."""

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
            module.__dict__[alias] = getattr(importlib.import_module(f"{package}.msg"), name)
        run(code, module.__dict__)
