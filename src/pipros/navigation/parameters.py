"""Read a node's parameters from a dictionary, with the rules of roscpp."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, fields
from typing import Any, TypeGuard, TypeVar

from pipros.basics.errors import NotFound, PiprosError
from pipros.libraries.reconfiguring.server import Setting
from pipros.node import Node

_Kind = TypeVar("_Kind")


class InvalidParameter(PiprosError, ValueError):
    """A parameter has an invalid value. The text names the parameter and the value."""


class PrivateParameters:
    """The private parameters of a node, or those in a namespace below `~`.

    As in roscpp, a value of another type is ignored, so that the default applies. However, a float is
    accepted and rounded for an integer parameter, and an integer is accepted for a float parameter.
    """

    def __init__(self, values: Mapping[str, Any], name: str = "~") -> None:
        """Store the values. `name` is the prefix of parameter names in error messages."""
        self.values = values
        self._name = name

    def has(self, name: str) -> bool:
        return name in self.values

    def boolean(self, name: str, default: bool) -> bool:
        value = self.values.get(name)
        return value if isinstance(value, bool) else default

    def text(self, name: str, default: str) -> str:
        value = self.values.get(name)
        return value if isinstance(value, str) else default

    def number(self, name: str, default: float) -> float:
        value = self.values.get(name)
        return float(value) if is_number(value) else default

    def integer(self, name: str, default: int) -> int:
        value = self.values.get(name)
        if not is_number(value) or not math.isfinite(value):
            return default
        return math.floor(value + 0.5)

    def read(self, kind: type[_Kind], **known: Any) -> _Kind:
        """Create an instance of a dataclass. Fields that are not in `known`, and have a default of type bool,
        int, float or str, are read from parameters of the same names.
        """
        readers: Any = {bool: self.boolean, int: self.integer, float: self.number, str: self.text}
        for each in fields(kind):  # type: ignore[arg-type]
            if each.name not in known and type(each.default) in readers:
                known[each.name] = readers[type(each.default)](each.name, each.default)
        return kind(**known)

    def numbers(self, name: str, length: int, default: Sequence[float]) -> tuple[float, ...]:
        """Return a list of numbers, or `default` if the parameter is not set.

        Raises:
            InvalidParameter: the parameter is not a list of `length` numbers, or is missing and `default` is
                empty.
        """
        return tuple(map(float, self._listed(name, length, default, is_number, "numbers")))

    def booleans(self, name: str, length: int) -> tuple[bool, ...]:
        """Return a list of booleans.

        Raises:
            InvalidParameter: the parameter is not a list of `length` booleans.
        """
        return tuple(self._listed(name, length, (), lambda value: isinstance(value, bool), "booleans"))

    def _listed(self, name: str, length: int, default: Sequence[Any], fits: Any, kind: str) -> Sequence[Any]:
        if name not in self.values and default:
            return default
        value = self.values.get(name)
        if not isinstance(value, list) or len(value) != length or not all(map(fits, value)):
            raise InvalidParameter(f"{self._name}{name} must be a list of {length} {kind}, got {value!r}")
        return value


def tunable(
    default: Any,
    text: str,
    low: float | None = None,
    high: float | None = None,
    *,
    edit_method: str = "",
    offered: Any = None,
) -> Any:
    """Declare a field of a dataclass as a parameter that clients of dynamic_reconfigure can change.

    See `Setting`. `offered` is the default that clients receive, if it differs from `default`.
    """
    declared = default if offered is None else offered, low, high, text, 0, edit_method
    return field(default=default, metadata={"setting": declared})


def settings_of(kind: type) -> list[Setting]:
    """Return the declared settings of a dataclass."""
    return [Setting(each.name, *each.metadata["setting"]) for each in fields(kind) if each.metadata]


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
