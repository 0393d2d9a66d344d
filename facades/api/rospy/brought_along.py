"""Modules that scripts use without importing them, because Noetic's `import rospy` imports them.

In Noetic, `import xml, rospy` is enough for `xml.etree.ElementTree`. Here such a module is imported at its
first use, which keeps start-up fast.
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
"""The modules that are imported implicitly, by package. Each package is an empty file, or is imported anyway.
"""


def bring_along() -> None:
    """Make the packages of `MODULES` import these modules at their first use. May be called repeatedly."""
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
