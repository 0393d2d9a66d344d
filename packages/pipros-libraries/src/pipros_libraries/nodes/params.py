"""Read a node's parameters by the rules of roscpp.

Defaults replace parameters that are unset or have another type, also if the master does not answer.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Container, Mapping, Sequence
from dataclasses import fields
from itertools import takewhile
from typing import Any, TypeGuard, TypeVar

from pipros.basics.errors import NotFound, PiprosError
from pipros.node import Node

__all__ = ["InvalidParameter", "PrivateParameters", "read_parameters"]

_INT = 2**31
_MOST = 1e9
"""The greatest number in a field of a dataclass: neither its square nor its nanoseconds overflow."""

Value = TypeVar("Value")


class InvalidParameter(PiprosError, ValueError):
    """A parameter has an invalid value. The text names the parameter and the value."""


def raw(node: Node, name: str, default: Any = None) -> Any:
    """Return a private parameter of any type, or `default` if it is not set."""
    try:
        return node.params.get(f"~{name}")
    except (LookupError, PiprosError):
        return default


def private(node: Node, name: str, default: Value) -> Value:
    """Return a private parameter in the type of `default`; see `read`."""
    return read(raw(node, name), default)


def number(node: Node, name: str, default: float) -> float:
    """Return a private parameter if it is a finite number, otherwise `default`."""
    value = private(node, name, float(default))
    return value if math.isfinite(value) else default


def private_ns(node: Node, name: str, default_s: float) -> int:
    """Return a private parameter in seconds as nanoseconds.

    Raises:
        InvalidParameter: it is NaN or huge.
    """
    given = PrivateParameters({name: raw(node, name)})
    return round(given.number(name, default_s, _MOST) * 1_000_000_000)


def read(value: Any, default: Value) -> Value:
    """Return a parameter in the type of `default`, or `default` if roscpp does not convert it."""
    found: Any = converted(value, type(default))
    return default if found is None else found


def converted(value: Any, kind: type) -> Any:
    """Convert a parameter as roscpp's `param` does. Return None if it has another type.

    Only numbers are converted: an integer to a float, and a float to the next integer if its fraction is at
    least a half, otherwise (also if it is negative) to the integer below. If that is not an integer of 32
    bits, the result is None; in roscpp, it is the smallest one.
    """
    if kind is bool or kind is str:
        return value if isinstance(value, kind) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    if kind is float:
        return kind(value)
    if not math.isfinite(value):
        return None
    whole = math.floor(value + 0.5 if value > 0 else value)
    return kind(whole) if -_INT <= whole < _INT else None


def converted_list(value: Any, kind: type) -> list[Any] | None:
    """Convert a list as roscpp's `param` does. Return None if the value is not a list, or an element differs.

    Numbers and bools are converted into each other; the fraction of a number is dropped.
    """
    if not isinstance(value, list):
        return None
    if kind is str:
        return value if all(isinstance(each, str) for each in value) else None
    if not all(isinstance(each, int | float) for each in value):
        return None
    try:
        return [kind(each) for each in value]
    except (ValueError, OverflowError):  # an infinite float is not an integer
        return None


class PrivateParameters:
    """The private parameters of a node, or those in a namespace below `~`.

    Values are converted as by `read`.

    Attributes:
        problems: mistakes that the node reports, although it runs.
    """

    def __init__(self, values: Mapping[str, Any], name: str = "~") -> None:
        """Store the values. `name` is the prefix of parameter names in error messages."""
        self.values = values
        self.problems: list[str] = []
        self._name = name

    def has(self, name: str) -> bool:
        return name in self.values

    def boolean(self, name: str, default: bool) -> bool:
        return read(self.values.get(name), default)

    def text(self, name: str, default: str) -> str:
        return read(self.values.get(name), default)

    def number(
        self, name: str, default: float, most: float = sys.float_info.max, *, is_endless: bool = False
    ) -> float:
        """Return a number.

        Raises:
            InvalidParameter: it is NaN, but the default is not; or it is further from 0 than `most`, the
                default is finite, and not `is_endless`.
        """
        value = read(self.values.get(name), float(default))
        is_bounded = math.isfinite(default) and not is_endless
        if (math.isnan(value) and not math.isnan(default)) or (is_bounded and abs(value) > most):
            rule = f"from -{most:g} to {most:g}" if math.isfinite(value) else "a finite number"
            raise InvalidParameter(f"{self._name}{name} must be {rule}, got {value}")
        return value

    def integer(self, name: str, default: int) -> int:
        return read(self.values.get(name), default)

    def read(self, kind: type[Value], endless: Container[str] = (), **known: Any) -> Value:
        """Create an instance of a dataclass. Fields that are not in `known`, and have a default of type bool,
        int, float or str, are read from parameters of the same names. Those in `endless` may be infinite.

        Raises:
            InvalidParameter: a number is NaN or huge; see `number`.
        """
        readers: Any = {bool: self.boolean, int: self.integer, str: self.text}
        for each in fields(kind):  # type: ignore[arg-type]
            if each.name in known:
                continue
            if type(each.default) is float:
                is_endless = each.name in endless
                known[each.name] = self.number(each.name, each.default, _MOST, is_endless=is_endless)
            elif type(each.default) in readers:
                known[each.name] = readers[type(each.default)](each.name, each.default)
        return kind(**known)

    def numbers(self, name: str, length: int, default: Sequence[float]) -> tuple[float, ...]:
        """Return a list of numbers, or `default` if the parameter is not set.

        Raises:
            InvalidParameter: the parameter is not a list of `length` finite numbers, or is missing and
                `default` is empty.
        """
        if name not in self.values and default:
            return tuple(map(float, default))
        found = converted_list(self.values.get(name), float)
        if found is None or len(found) != length or not all(map(math.isfinite, found)):
            value = self.values.get(name)
            raise InvalidParameter(f"{self._name}{name} must be a list of {length} numbers, got {value!r}")
        return tuple(found)

    def flags(self, name: str, length: int) -> tuple[bool, ...]:
        """Return a list of booleans. Other elements, those after them and missing ones are False.

        Such a mistake is added to `problems`.
        """
        value = self.values.get(name)
        given = value[:length] if isinstance(value, list) else []
        found = list(takewhile(lambda each: isinstance(each, bool), given))
        if not isinstance(value, list) or len(value) != length or len(found) != length:
            self.problems.append(
                f"{self._name}{name} must be a list of {length} booleans, got {value!r}; the others are false"
            )
        return (*found, *[False] * (length - len(found)))


def is_number(value: Any) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def read_parameters(node: Node, namespace: str = "~") -> PrivateParameters:
    """Read a node's parameters in its private namespace, or in a namespace below it, such as `~costmap`."""
    try:
        values = node.params.get(namespace)
    except NotFound:
        values = {}
    return PrivateParameters(values if isinstance(values, dict) else {}, f"{namespace}/".replace("~/", "~"))


def search_upwards(node: Node, namespace: str, name: str) -> Any:
    """Return a parameter from a namespace, or from the nearest parent that sets it, or None."""
    place = node.resolve(namespace)
    while True:
        try:
            return node.params.get(f"{place}/{name}")
        except NotFound:
            if not place:
                return None
            place = place.rpartition("/")[0]
