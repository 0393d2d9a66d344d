"""Module attributes that are imported at their first use, which keeps start-up fast."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(module: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` for a module some of whose names live in other modules.

    Args:
        module: the module's own name.
        homes: for each name the module that defines it, or `module:name` if it has another name there.
    """

    def get(name: str) -> Any:
        home = homes.get(name)
        if home is None:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        where, _, original = home.partition(":")
        return getattr(import_module(where), original or name)

    def names() -> list[str]:
        return sorted({*vars(sys.modules[module]), *homes})

    return get, names
