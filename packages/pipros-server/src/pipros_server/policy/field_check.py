"""Compare the values of a message with the rules for its fields. Performs no I/O.

Every value in the message is checked: a field without a rule must have its default (zero, false, empty), so a
rule for `linear.x` does not leave `linear.y` unrestricted. A header may have any `seq` and `stamp`. `any`
permits all values of a field, except in fields and elements below it that have their own rules. A quaternion
that has a rule must have the norm 1, because nodes refuse others, which may end a movement without a stop.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, Final

from pipros.basics.printable import printable
from pipros.msg.class_finder import installed_class
from pipros.msg.time import TVal
from pipros_server.policy.model import EACH, ActRefused, FieldRule, FieldTree

POLICY_VALUES = 10_000
"""Limit: values of a message that are compared with a policy. Beyond it, the message is refused, because the
values beyond the limit would not be compared with the policy.
"""

_EMPTY: Final = FieldTree()
_FLOAT32 = struct.Struct("<f")
_HEADER: Final = ("Header", "std_msgs/Header", "roslib/Header")
_QUATERNION: Final = "geometry_msgs/Quaternion"
_NORM_TOLERANCE: Final = 0.01
_FREE: Final = ("seq", "stamp")


class FieldCheck:
    """Checks one message, and collects the values whose change is limited.

    Attributes:
        limited: the values whose change is limited, by path, with their rules.
    """

    def __init__(self, what: str, place: str, *, is_stop: bool = False) -> None:
        """Create a check. Error texts contain `what`, such as `/cmd_vel`, and the rule's location `place`.

        In a stop, zero and empty values pass, although a robot may not have to move that slowly, and so do
        texts and whole numbers without a range, which may stand for a mode that clients may not request.
        """
        self.limited: dict[str, tuple[float, FieldRule]] = {}
        self._what = what
        self._place = place
        self._is_stop = is_stop
        self._left = POLICY_VALUES

    def message(self, value: Any, tree: FieldTree, path: str = "") -> None:
        """Check the fields of a message.

        Raises:
            ActRefused: a value is not permitted, or there are too many values.
        """
        if _permits_all(tree) and not _turns(value._type):
            return
        if value._type == _QUATERNION and (tree.rule is not None or tree.below):
            norm = math.hypot(value.x, value.y, value.z, value.w)
            if not abs(norm - 1.0) <= _NORM_TOLERANCE and not (self._is_stop and norm == 0):
                text = f"{self._named(path)} must be a quaternion with the norm 1, got the norm {norm:g}"
                raise ActRefused(text, tree.rule.place if tree.rule is not None else self._place)
        is_header = value._type in _HEADER
        for name, kind in zip(value.__slots__, value._slot_types, strict=True):
            below = _below(tree, tree.below.get(name))
            if is_header and name in _FREE and below is _EMPTY:
                continue
            self.value(getattr(value, name), kind, below, f"{path}.{name}" if path else name)

    def value(self, value: object, kind: str, tree: FieldTree, path: str) -> None:
        """Check a value of any type; see `message`."""
        rule = tree.rule
        if _permits_all(tree) and not _turns(kind):
            return
        if kind.endswith("]"):
            self._array(value, kind, tree, path)
            return
        self._left -= 1
        if self._left < 0:
            most = f"the limit is {POLICY_VALUES}"
            raise ActRefused(f"{self._what} has too many values to compare; {most}", self._place)
        if hasattr(value, "_slot_types") and not isinstance(value, TVal):
            self.message(value, tree, path)
            return
        if isinstance(value, TVal):
            value = value.to_sec()
        if self._is_stop and (
            value in (0, "", b"") or (not isinstance(value, float) and (rule is None or rule.one_of))
        ):
            return
        if rule is None:
            if value not in (0, "", b""):  # False equals 0, and NaN equals none of these
                raise ActRefused(
                    f"{self._named(path)} has no rule and must be zero or empty, got {_shown(value)}"
                )
            return
        found = check_value(value, rule, self._named(path), is_single=kind == "float32")
        if rule.change_per_s is not None:
            self.limited[path] = found, rule

    def _array(self, value: Any, kind: str, tree: FieldTree, path: str) -> None:
        kind_of_element = kind.rpartition("[")[0]
        each = tree.below.get(EACH)
        of_all = each.rule if each is not None else None
        if of_all is not None and of_all.count is not None and len(value) > of_all.count:
            text = f"{self._named(path)} may have at most {of_all.count} elements, got {len(value)}"
            raise ActRefused(text, of_all.place)
        if not tree.below and kind.endswith("[]") and len(value) and not self._is_stop:
            raise ActRefused(
                f"{self._named(path)} has no rule and must be empty, got {len(value)} elements", self._place
            )
        others = _below(tree, each)
        numbers: Iterable[Any] = range(len(value))
        if _permits_all(others) and not _turns(kind):
            numbers = [number for number in tree.below if number != EACH]
        for number in numbers:
            if number < len(value):
                below = _below(tree, tree.below.get(number, others))
                self.value(value[number], kind_of_element, below, f"{path}[{number}]")

    def _named(self, path: str) -> str:
        return f"{path} of {self._what}" if path else self._what


def _permits_all(tree: FieldTree) -> bool:
    return tree.rule is not None and tree.rule.is_any and not tree.below


@cache
def _turns(kind: str) -> bool:
    """Return whether values of a type contain quaternions."""
    base = kind.partition("[")[0]
    if "/" not in base or base in _HEADER:
        return base == _QUATERNION
    found = installed_class(base)
    return base == _QUATERNION or (found is not None and any(map(_turns, found._slot_types)))


def is_finite(value: object) -> bool:
    """Return whether all numbers in a message are finite."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, list | tuple):
        return all(map(is_finite, value))
    return all(is_finite(getattr(value, name)) for name in getattr(value, "__slots__", ()))


def _below(tree: FieldTree, below: FieldTree | None) -> FieldTree:
    """Return the rules for a part of a field: its own rules or, if missing, the field's rule `any`."""
    if tree.rule is None or not tree.rule.is_any:
        return below or _EMPTY
    if below is None or below.rule is None:
        return FieldTree(tree.rule, {} if below is None else below.below)
    return below


def check_value(value: object, rule: FieldRule, what: str, *, is_single: bool = False) -> Any:
    """Return a value if a rule permits it. If `is_single` is true, round it and the limits to `float32`.

    Raises:
        ActRefused: the rule does not permit the value.
    """
    if rule.is_any:
        return value
    if rule.one_of:
        # 1 and 1.0 are the same number, but True is not 1
        if not any(
            value == each and isinstance(value, bool) == isinstance(each, bool) for each in rule.one_of
        ):
            wanted = ", ".join(map(_shown, rule.one_of))
            raise ActRefused(f"{what} must be one of {wanted}; got {_shown(value)}", rule.place)
        return value
    if isinstance(value, bool | str | bytes) or not hasattr(value, "__float__"):
        raise ActRefused(f"{what} must be a number, got {_shown(value)}", rule.place)
    try:
        number = float(value)
        least, most = rule.least, rule.most
        if is_single:  # round the limits as well: 0.3 as a float32 is not 0.3
            number, least, most = _single(number), _single(least), _single(most)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ActRefused(f"{what} must be a finite number, got {_shown(value)}", rule.place)
    if not least <= number <= most:
        got = rule.unit.shown(number)
        raise ActRefused(f"{what} must be {rule.shown_range}, got {got}", rule.place)
    return number


def check_changes(
    found: Mapping[str, tuple[float, FieldRule]], before: Mapping[str, float], elapsed_s: float, what: str
) -> None:
    """Compare values with the values of the previous permitted message, `elapsed_s` seconds earlier.

    Raises:
        ActRefused: a value changes too fast.
    """
    seconds = min(max(elapsed_s, 0.0), 1.0)
    for path, (value, rule) in found.items():
        previous = before.get(path, rule.start)
        most = (rule.change_per_s or 0.0) * seconds
        if abs(value - previous) > most * (1 + 1e-9) + 1e-12:
            limit = rule.unit.shown(rule.change_per_s or 0.0)
            raise ActRefused(
                f"{path} of {what} may change by at most {limit} per second, "
                f"got {rule.unit.shown(value)} after {rule.unit.shown(previous)}",
                rule.place,
            )


def _single(number: float) -> float:
    return float(_FLOAT32.unpack(_FLOAT32.pack(number))[0]) if math.isfinite(number) else number


def _shown(value: object) -> str:
    return printable(ascii(value), 60)
