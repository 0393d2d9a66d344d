"""Copies of a good message in which one number is an edge value of its type."""

import math
import struct
from collections.abc import Iterator
from copy import deepcopy
from typing import Any, Final

from pipros.msg.language.spec import INTEGERS, TIMES

FLOATS: Final = (math.nan, math.inf, 1e308, -1e308, 5e-324, 0.0)
_SINGLE: Final = 3.4e38


def edge_messages(good: Any) -> Iterator[tuple[str, Any]]:
    """Yield the changed field with its value, and the changed copy. Strings are not changed."""
    for path in _paths(good, ()):
        yield from _changed(good, path)


def _paths(message: Any, before: tuple[Any, ...]) -> Iterator[tuple[Any, ...]]:
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        value, path = getattr(message, name), (*before, name)
        if hasattr(value, "_slot_types") and kind not in TIMES:
            yield from _paths(value, path)
        elif kind.endswith("]") and len(value) and hasattr(value[0], "_slot_types"):
            yield from _paths(value[0], (*path, 0))
        elif kind.partition("[")[0] != "string":
            yield (*path, kind)


def _changed(good: Any, path: tuple[Any, ...]) -> Iterator[tuple[str, Any]]:
    *steps, name, kind = path
    base, _, array = kind.partition("[")
    field = ".".join(map(str, (*steps, name)))
    for value in _values(base):
        copy, owner, old = _found(good, steps, name)
        changed = value
        if base in TIMES:
            changed = type(old)(*value)
        elif array:
            changed = bytes([value % 256]) * len(old) if isinstance(old, bytes) else [value] * len(old)
        setattr(owner, name, changed)
        yield f"{field} = {value}", copy
    if array == "]":
        copy, owner, old = _found(good, steps, name)
        setattr(owner, name, type(old)())
        yield f"{field} is empty", copy


def _found(good: Any, steps: list[Any], name: str) -> tuple[Any, Any, Any]:
    """Return a copy of a message, the part of it that has a field, and the field's value."""
    copy = owner = deepcopy(good)
    for step in steps:
        owner = owner[step] if isinstance(step, int) else getattr(owner, step)
    return copy, owner, getattr(owner, name)


def _values(kind: str) -> tuple[Any, ...]:
    if kind == "float64":
        return FLOATS
    if kind == "float32":
        return tuple(max(min(each, _SINGLE), -_SINGLE) if math.isfinite(each) else each for each in FLOATS)
    if kind == "time":
        return ((0, 0), (2**32 - 1, 999_999_999))
    if kind == "duration":
        return ((-(2**31), 0), (2**31 - 1, 999_999_999))
    if kind == "bool":
        return (False, True)
    bits, code = 8 * struct.calcsize(INTEGERS[kind]), INTEGERS[kind]
    return (0, 2**bits - 1) if code.isupper() else (-(2 ** (bits - 1)), 0, 2 ** (bits - 1) - 1)
