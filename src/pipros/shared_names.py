"""Names of a module that stand for attributes of an object: other packages read and set them."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from types import ModuleType


def share_names(module: str, owner: object, attributes: Mapping[str, str]) -> None:
    """Has names of a module be attributes of an object: read there, and set there.

    Args:
        module: the module's own name.
        attributes: for each name that of the attribute.
    """

    def shared(attribute: str) -> property:
        return property(
            lambda _: getattr(owner, attribute), lambda _, value: setattr(owner, attribute, value)
        )

    names = {name: shared(attribute) for name, attribute in attributes.items()}
    sys.modules[module].__class__ = type("ModuleOfSharedNames", (ModuleType,), names)
