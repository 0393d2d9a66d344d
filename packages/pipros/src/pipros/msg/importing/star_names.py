"""Names that a star import from a message module binds besides types: the imports of generated modules.

After `from rosapi.srv import *`, scripts can use `rosapi.srv.Topics`, `genpy.Time` and `struct.pack`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module
from types import ModuleType

MODULES = ("codecs", "genpy", "struct", "sys")
"""The modules that every generated module imports. A generated module also sets `python3`."""


def imported_name(name: str) -> object:
    """Return the value that every generated module binds to this name.

    Raises:
        AttributeError: no generated module imports this name.
    """
    if name == "python3":
        return True
    if name in MODULES:
        return import_module(name)
    raise AttributeError(name)


def imported_names(classes: Iterable[object], messages_of: Callable[[str], ModuleType]) -> dict[str, object]:
    """Return all names that the modules generated for these messages import, with their values.

    The names include the packages of all embedded messages, at any depth.

    Args:
        messages_of: function that imports the module with the messages of a package.
    """
    found = {name: imported_name(name) for name in (*MODULES, "python3")}
    seen, new = set[str](), list(classes)
    while new:
        for field_type in getattr(new.pop(), "_slot_types", ()):
            type_name = field_type.partition("[")[0]
            package, slash, name = type_name.partition("/")
            if slash and type_name not in seen:
                seen.add(type_name)
                module = messages_of(package)
                new.append(getattr(module, name))
                found[package] = import_module(module.__name__.removesuffix(".msg"))
    return found
