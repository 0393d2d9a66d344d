"""`genpy.base`: the types that are serialized as a single number."""

from __future__ import annotations

from pipros.msg.language.spec import NUMBERS

__all__ = ["SIMPLE_TYPES", "SIMPLE_TYPES_DICT", "is_simple"]

_SIZED = [name for name in NUMBERS if name not in ("bool", "byte", "char")]

SIMPLE_TYPES = [*_SIZED[:2], "bool", *_SIZED[2:], "char", "byte"]
SIMPLE_TYPES_DICT = {name: "B" if name == "bool" else NUMBERS[name] for name in SIMPLE_TYPES}
"""The types, with their `struct` format characters."""


def is_simple(type_: str) -> bool:
    """Return whether a type is serialized as a single number."""
    return type_ in SIMPLE_TYPES_DICT
