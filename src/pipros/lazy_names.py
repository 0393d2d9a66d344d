"""Names of a module that are imported when they are asked for, so that start-up does not pay for them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(module: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a module, some of whose names live in other modules.

    Args:
        module: the module's own name.
        homes: for each name the module that has it, or `module:name` when it is called otherwise there.
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
