"""Read the rules for fields, parameters and conditions from a policy file."""

from __future__ import annotations

import math
import os
import re
import sys
from typing import Any, Final

from pipros.msg.class_finder import installed_class
from pipros.msg.language.spec import FLOATS, INTEGERS, TIMES
from pipros.safe.settings import Settings
from pipros_server.policy.model import EACH, FieldRule, FieldTree, Unit

UNITS: Final = {
    **dict.fromkeys(("", "m", "m/s", "m/s^2", "rad", "rad/s", "rad/s^2"), 1.0),
    **dict.fromkeys(("s", "kg", "N", "Nm", "V", "A"), 1.0),
    **dict.fromkeys(("%", "cm", "cm/s"), 0.01),
    **dict.fromkeys(("mm", "mm/s", "ms"), 0.001),
    **dict.fromkeys(("deg", "deg/s", "deg/s^2"), math.pi / 180),
    "km/h": 1 / 3.6,
}
"""Units in policy files, with the factors that convert them to the units of messages (REP 103)."""

ORDERED = frozenset((*INTEGERS, *FLOATS, *TIMES))
"""Types whose values can have a range."""
PLAIN = ("string", "bool")
_STEP = re.compile(r"([A-Za-z]\w*)((?:\[\d*\]){0,99})")

NUMERIC: Final = ("range",)
"""Bounds of numbers. An argument of a launch file that has one is a number."""

BOUNDS: Final = (*NUMERIC, "one_of", "unit")
"""Keys that bound one value, wherever a policy has one: in fields, parameters, arguments and conditions."""

_FIELD_KEYS = (*BOUNDS, "change_per_s", "start", "count")


def place_of(section: Settings, key: str = "") -> str:
    """Return the location of a key, for error texts sent to clients. It does not reveal the file's folder."""
    file, colon, name = section.place(key).partition(": ")
    return f"{os.path.basename(file)}{colon}{name}"


def read_fields(section: Settings, message_class: object) -> FieldTree:
    """Return the rules under the key `fields` as a tree. Fields that do not exist are errors."""
    if section.values.get("fields") == "any":
        return FieldTree(FieldRule(place=place_of(section), is_any=True))
    fields = section.section("fields")
    root: dict[str | int, Any] = {}
    for key, value in fields.values.items():
        path, kind = field_path(fields, key, message_class)
        if value == "any":
            rule = FieldRule(place=place_of(fields, key), is_any=True)
        else:
            spec = fields.section(key)
            spec.only(_FIELD_KEYS)
            if not kind.startswith("/") and kind.endswith("]"):
                raise fields.error(key, f"is an array; write {key}[] for all elements, or {key}[0]")
            is_number = kind in ORDERED
            rule = read_rule(spec, is_number=is_number, is_element=path[-1] == EACH, kind=kind)
            if not is_number and kind not in PLAIN and rule.count is None:
                raise fields.error(key, f"has the type {kind}; name its fields, or write {key}: any")
        node = root
        for step in path:
            node = node.setdefault(step, {})
        if None in node:
            raise fields.error(key, "occurs twice")
        node[None] = rule  # type: ignore[index]
    return _tree(root)


def read_rule(spec: Settings, *, is_number: bool, is_element: bool = False, kind: str = "") -> FieldRule:
    """Parse a rule.

    Args:
        is_number: whether the field is a number.
        is_element: whether the rule applies to all elements of an array.
        kind: the type of the field, for `one_of`; empty if it is unknown.
    """
    unit = _unit(spec)
    numeric = [key for key in (*NUMERIC, "unit", "change_per_s", "start") if key in spec.values]
    if numeric and not is_number:
        raise spec.error(numeric[0], "applies to numbers only")
    if "range" in spec.values and "one_of" in spec.values:
        raise spec.error("one_of", "must not be combined with range")
    least, most = _range(spec, "range")
    one_of = _one_of(spec, kind, unit.factor, is_number=is_number)
    change = spec.number("change_per_s", 0, least=0) * unit.factor if "change_per_s" in spec.values else None
    if change is not None and one_of:
        raise spec.error("change_per_s", "must not be combined with one_of")
    if "start" in spec.values and change is None:
        raise spec.error("start", "needs the key change_per_s")
    start = spec.number("start", 0, least=-math.inf) * unit.factor
    count = _count(spec, is_element=is_element)
    _check_bounded(spec)
    return FieldRule(
        place=place_of(spec),
        least=least * unit.factor,
        most=most * unit.factor,
        one_of=one_of,
        unit=unit,
        change_per_s=change,
        start=start,
        count=count,
    )


def _unit(spec: Settings) -> Unit:
    name = spec.text("unit", "")
    if name not in UNITS:
        raise spec.error("unit", f"must be one of {', '.join(filter(None, UNITS))}, got {name!r}")
    return Unit(name, UNITS[name])


def _one_of(spec: Settings, kind: str, factor: float, *, is_number: bool) -> tuple[Any, ...]:
    """Return the values under the key `one_of`; numbers are multiplied by `factor`."""
    values = spec.values.get("one_of", [])
    if not isinstance(values, list) or ("one_of" in spec.values and not values):
        raise spec.error("one_of", f"must be a non-empty list of values, got {values!r}")
    for each in values:
        if not isinstance(each, bool | int | float | str) or each != each:  # NaN
            raise spec.error("one_of", f"must contain only numbers, strings and booleans, got {each!r}")
        if kind and type(each) not in _kinds_of(kind, is_number=is_number):
            raise spec.error("one_of", f"must contain values of the type {kind}, got {each!r}")
    numbers = [each for each in values if isinstance(each, int | float)]
    if not all(abs(each) <= sys.float_info.max for each in numbers):
        raise spec.error("one_of", f"must contain finite numbers, got {numbers!r}")
    if factor == 1.0:
        return tuple(values)
    return tuple(each if isinstance(each, str) else each * factor for each in values)


def _count(spec: Settings, *, is_element: bool) -> int | None:
    if "count" not in spec.values:
        return None
    if not is_element:
        raise spec.error("count", "applies only to all elements of an array, such as points[]")
    return whole(spec, "count", 1_000_000)


def _check_bounded(spec: Settings) -> None:
    if any(key in spec.values for key in ("range", "one_of", "change_per_s", "count")):
        return
    if spec.key.startswith("launch"):
        raise spec.error("", "must have range or one_of")
    if spec.key.startswith(("topics", "services", "actions")):
        raise spec.error("", "must have range, one_of, change_per_s or count; `any` allows all values")


def _kinds_of(kind: str, *, is_number: bool) -> tuple[type, ...]:
    return (int, float) if is_number else (str,) if kind in ("str", "string") else (bool,)


def _tree(node: dict[Any, Any]) -> FieldTree:
    rule = node.pop(None, None)
    return FieldTree(rule, {key: _tree(below) for key, below in node.items()})


def field_path(
    section: Settings, text: object, message_class: Any, key: str | None = None
) -> tuple[tuple[str | int, ...], str]:
    """Return the steps of a field such as `points[].positions[0]`, and its type."""
    where = str(text) if key is None else key
    if not isinstance(text, str):
        raise section.error(where, "must be the name of a field, such as linear.x")
    path: list[str | int] = []
    kind = message_class._type
    current = message_class
    for word in text.split("."):
        match = _STEP.fullmatch(word)
        if match is None:
            raise section.error(where, f"{text} is not the name of a field, such as linear.x or joints[]")
        fields = {} if current is None else dict(zip(current.__slots__, current._slot_types, strict=True))
        name, indexes = match[1], re.findall(r"\[(\d*)\]", match[2])
        if name not in fields:
            raise section.error(
                where, f"{kind} has no field {name}. Its fields: {', '.join(fields) or 'none'}"
            )
        kind = fields[name]
        path.append(name)
        for index in indexes:
            if not kind.endswith("]"):
                raise section.error(where, f"{name} is not an array")
            kind, _, length = kind[:-1].rpartition("[")
            if index and length and int(index) >= int(length):
                raise section.error(
                    where, f"{name} has {length} elements, so the last one is {name}[{int(length) - 1}]"
                )
            path.append(int(index) if index else EACH)
        current = installed_class(kind) if "/" in kind and not kind.endswith("]") else None
    return tuple(path), kind


def _range(spec: Settings, key: str) -> tuple[float, float]:
    if key not in spec.values:
        return -math.inf, math.inf
    ends = spec.numbers(key)
    if len(ends) != 2 or ends[0] > ends[1]:
        raise spec.error(
            key, f"must be two numbers, the smaller one first, such as [-0.3, 0.3], got {list(ends)}"
        )
    return ends[0], ends[1]


def whole(section: Settings, key: str, most: int) -> int:
    """Return a setting, which must be a whole number from 1 to `most`."""
    value = section.number(key, None, least=1, most=most)
    if value != int(value):
        raise section.error(key, f"must be a whole number, got {value}")
    return int(value)
