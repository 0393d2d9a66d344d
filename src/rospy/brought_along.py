"""Modules that scripts use without importing them, because `import rospy` of Noetic has imported them.

`import xml, rospy` is enough there for `xml.etree.ElementTree`. Here such a module is imported when it is
first asked for, so that no start-up pays for it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

MODULES = {
    "importlib": ("util",),
    "logging": ("config", "handlers"),
    "xml": ("dom", "etree", "parsers"),
    "xml.dom": ("minidom",),
    "xml.etree": ("ElementTree",),
    "xml.parsers": ("expat",),
    "xmlrpc": ("client", "server"),
}
"""The modules that are brought along, by the package that they are in. Each package is an empty file, or is
imported anyway."""


def bring_along() -> None:
    """Makes the packages of `MODULES` import these modules when they are asked for. May be repeated."""
    for package, names in MODULES.items():
        module = import_module(package)
        if "__getattr__" not in vars(module):
            vars(module)["__getattr__"] = _importer(module, names)


def _importer(package: ModuleType, names: tuple[str, ...]) -> Callable[[str], Any]:
    def get(name: str) -> Any:
        if name in names:
            return import_module(f"{package.__name__}.{name}")
        raise AttributeError(f"module {package.__name__!r} has no attribute {name!r}")

    return get
