"""Cells of tables as plain values, to compare them with the messages of the library rosbags."""

import dataclasses
import random
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from pipros.msg import load_message_class
from pipros.msg.bulk.columns import ListColumn, OctetColumn, RecordColumn, TextColumn
from pipros.msg.language.spec import NUMBERS


def seeded(seed: int | str) -> random.Random:
    return random.Random(seed)  # noqa: S311


@cache
def store_for(type_name: str) -> Any:
    """Return a type store of rosbags that knows a type and all types that it embeds."""
    store = get_typestore(Stores.EMPTY)
    full_name = type_name.replace("/", "/msg/")
    text = load_message_class(type_name)._full_text  # type: ignore[attr-defined]
    store.register(get_types_from_msg(text, full_name))
    return store


def read_by_rosbags(type_name: str, data: bytes) -> Any:
    return store_for(type_name).deserialize_ros1(data, type_name.replace("/", "/msg/"))


def plain(value: Any) -> Any:
    """Convert a value of rosbags: messages become dictionaries, arrays lists, times nanoseconds."""
    if dataclasses.is_dataclass(value):
        if type(value).__name__ in ("builtin_interfaces__msg__Time", "builtin_interfaces__msg__Duration"):
            both: Any = value
            return both.sec * 10**9 + both.nanosec
        return {
            field.name: plain(getattr(value, field.name))
            for field in dataclasses.fields(value)
            if field.name != "__msgtype__"
        }
    if isinstance(value, np.ndarray):
        return [_number(each) for each in value.tolist()]
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return _number(value)


def cell(column: Any, row: int) -> Any:
    """Return one cell of a column in the same form."""
    value = column[row]
    if isinstance(column, TextColumn):
        return value
    if isinstance(column, OctetColumn):
        return list(value)
    if isinstance(column, ListColumn | RecordColumn):
        return nested(value) if isinstance(value, dict) else [_one(value, at) for at in range(len(value))]
    return value.tolist() if not isinstance(value, np.ndarray) else [_number(each) for each in value.tolist()]


def _one(values: Any, at: int) -> Any:
    if isinstance(values, RecordColumn):
        return nested({name: cell(column, at) for name, column in values.columns.items()})
    return _number(cell(values, at))


def nested(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row with dotted names as nested dictionaries."""
    found: dict[str, Any] = {}
    for name, value in row.items():
        *path, last = name.split(".")
        inner = found
        for each in path:
            inner = inner.setdefault(each, {})
        inner[last] = _number(value)
    return found


def _number(value: Any) -> Any:
    return repr(value) if isinstance(value, float) else value  # NaN equals NaN, and 0.0 differs from -0.0


def same(expected: Any, got: Any, type_name: str) -> list[str]:
    """Return the differences between a message of rosbags and a row, both as plain values."""
    spec: Any = load_message_class(type_name)
    found = []
    for name, kind in zip(spec.__slots__, spec._slot_types, strict=True):
        base, bracket, length = kind.rstrip("]").partition("[")
        is_primitive = base in NUMBERS or base in ("string", "time", "duration")
        if length == "0" or (not bracket and not is_primitive and name not in got and expected[name] == {}):
            continue  # no bytes, no column
        theirs, ours = expected[name], got[name]
        if base == "byte":  # rosbags reads it without a sign
            theirs = [each - 256 if each > 127 else each for each in theirs] if bracket else theirs
            theirs = theirs - 256 if not bracket and theirs > 127 else theirs
        if bracket and not is_primitive and isinstance(ours, int):  # messages that take no bytes
            theirs = len(theirs)
        if is_primitive or isinstance(ours, int):
            if theirs != ours:
                found.append(f"{type_name}.{name}: {theirs!r} instead of {ours!r}")
        elif bracket:
            assert len(theirs) == len(ours)
            for one, other in zip(theirs, ours, strict=True):
                found += same(one, other, base)
        else:
            found += same(theirs, ours, base)
    return found
