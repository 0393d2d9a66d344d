"""Module attributes that forward reads and writes to an object's attributes."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from operator import attrgetter
from types import ModuleType


def share_names(module: str, owner: object, attributes: Mapping[str, str]) -> None:
    """Forward module attributes to `owner`, for reads and writes.

    Args:
        module: the module's own name.
        attributes: maps each name to an attribute of `owner`, or to `part.attribute` for an attribute of one
            of its parts.
    """

    def shared(path: str) -> property:
        part, _, attribute = path.rpartition(".")
        get_part = attrgetter(part) if part else lambda _: owner
        return property(
            lambda _: getattr(get_part(owner), attribute),
            lambda _, value: setattr(get_part(owner), attribute, value),
        )

    names = {name: shared(attribute) for name, attribute in attributes.items()}
    sys.modules[module].__class__ = type("ModuleOfSharedNames", (ModuleType,), names)
