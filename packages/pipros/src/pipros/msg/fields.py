"""Recognize messages without importing `base.py`, for modules that `base.py` itself imports."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol, TypeGuard

from pipros.msg.time import TVal


class HasFields(Protocol):
    """A message: `__slots__` names its fields, and `_get_types()` gives their types in the same order."""

    __slots__: list[str]
    _type: ClassVar[str]
    _slot_types: ClassVar[list[str]]

    def _get_types(self) -> list[str]: ...


def is_message(value: Any) -> TypeGuard[HasFields]:
    """Return True for an instance of a message class. Times have fields too, but are not messages."""
    return hasattr(type(value), "_slot_types") and not isinstance(value, TVal)
