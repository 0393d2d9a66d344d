"""Read a node's parameters from a dictionary, with the rules of roscpp."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, fields
from itertools import takewhile
from typing import Any, TypeGuard, TypeVar

from pipros.basics.errors import NotFound, PiprosError
from pipros.libraries.reconfiguring.server import Setting
from pipros.node import Node
from pipros.node.private_params import converted_list, read

__all__ = ["read_parameters"]  # for costmap layers of other distributions

_Kind = TypeVar("_Kind")


class InvalidParameter(PiprosError, ValueError):
    """A parameter has an invalid value. The text names the parameter and the value."""


class PrivateParameters:
    """The private parameters of a node, or those in a namespace below `~`.

    Values are converted as in roscpp (`pipros.node.private_params`); if that is not possible, defaults apply.

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

    def number(self, name: str, default: float) -> float:
        return read(self.values.get(name), float(default))

    def integer(self, name: str, default: int) -> int:
        return read(self.values.get(name), default)

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
        if name not in self.values and default:
            return tuple(map(float, default))
        found = converted_list(self.values.get(name), float)
        if found is None or len(found) != length:
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
