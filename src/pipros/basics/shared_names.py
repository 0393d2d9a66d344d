"""Module attributes that give access to the attributes of an object, which other packages read and set."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from types import ModuleType


def share_names(module: str, owner: object, attributes: Mapping[str, str]) -> None:
    """Forward module attributes to `owner`, for reads and writes.

    Args:
        module: the module's own name.
        attributes: the attribute of `owner` for each name.
    """

    def shared(attribute: str) -> property:
        return property(
            lambda _: getattr(owner, attribute), lambda _, value: setattr(owner, attribute, value)
        )

    names = {name: shared(attribute) for name, attribute in attributes.items()}
    sys.modules[module].__class__ = type("ModuleOfSharedNames", (ModuleType,), names)
