"""Module attributes that are imported on first use, which keeps start-up fast."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Mapping
from importlib import import_module
from typing import Any

TYPING = ("__future__", "collections.abc", "pathlib", "typing")
"""Modules from which other modules import names for annotations. Star imports do not re-export these
names.
"""


def lazy_names(
    module: str, homes: Mapping[str, str], submodules: Collection[str] = ()
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` for a module that takes some of its names from other modules.

    Args:
        module: the module's own name.
        homes: for each name, the module that defines it, or `module:name` if it has another name there.
        submodules: additional names, each a module in the package `module`.
    """

    def get(name: str) -> Any:
        if name in submodules:
            return import_module(f"{module}.{name}")
        home = homes.get(name)
        if home is None:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        where, _, original = home.partition(":")
        return getattr(import_module(where), original or name)

    def names() -> list[str]:
        return sorted({*vars(sys.modules[module]), *homes, *submodules})

    return get, names


def star_names(module: str, words: str = "", hidden: str = "") -> None:
    """Make a star import of a module bind additional names, which are imported on first access.

    Call this function after setting the module's `__all__` and `__getattr__`. A name from a library that is
    not installed is omitted. `dir(module)` is unchanged.

    Args:
        module: the module's own name.
        words: the names, separated by spaces: `threading` or `os.path` for a module, `io:StringIO` for a name
            in a module, and `urls=urllib.parse` for a module under another name.
        hidden: public names of the module that a star import omits.
    """
    namespace = vars(sys.modules[module])
    listed: list[str] | None = namespace.pop("__all__", None)
    own_get: Callable[[str], Any] | None = namespace.get("__getattr__")
    own_names: Callable[[], list[str]] = namespace.get("__dir__", lambda: list(namespace))
    homes: dict[str, str] = {}

    def home_of() -> dict[str, str]:
        if not homes:
            homes.update(map(_name_and_home, words.split()))
        return homes

    def get(name: str) -> Any:
        if name == "__all__":
            return all_names()
        home = home_of().get(name)
        if home is None:
            if own_get is not None:
                return own_get(name)
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        where, _, original = home.partition(":")
        try:
            value: Any = import_module(where)
        except ImportError as error:
            if own_get is not None:
                return own_get(name)
            raise AttributeError(f"module '{module}' cannot import '{name}': {error}") from error
        namespace[name] = value = getattr(value, original) if original else value
        return value

    def all_names() -> list[str]:
        own = [name for name in own_names() if name[0] != "_" and not _is_for_types(namespace.get(name))]
        wanted = {*(own if listed is None else listed), *home_of()} - set(hidden.split())
        return sorted(filter(is_available, wanted))

    def is_available(name: str) -> bool:
        try:
            return hasattr(sys.modules[module], name)
        except ImportError:
            return False

    namespace["__getattr__"] = get


def _name_and_home(word: str) -> tuple[str, str]:
    name, _, home = word.rpartition("=")
    return name or home.rpartition(":" if ":" in home else ".")[2], home


def _is_for_types(value: object) -> bool:
    return type(value).__module__ in TYPING or getattr(value, "__module__", "") in TYPING
