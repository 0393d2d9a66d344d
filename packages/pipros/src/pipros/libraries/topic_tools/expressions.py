"""Expressions for `transform` and `relay_field`. They are evaluated without running Python code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.libraries.topic_tools.modules import ARRAY, ModuleNames, module_for
from pipros.msg.field_access import field_of
from pipros.msg.time import Time
from pipros.safe.expr import Expression, ExpressionError
from pipros.safe.guarded import CONSTANTS, FUNCTIONS
from pipros.safe.yaml import load


class NotAMapping(PiprosError, ValueError):
    """The template of `relay_field` is not a mapping."""


def part_of(value: Any, name: str) -> Any:
    """Return a field of a message, a permitted attribute of an array, or a member of a module.

    Raises:
        AttributeError: the name does not exist or is not permitted.
    """
    if isinstance(value, ModuleNames):
        return value.find(name)
    if type(value).__module__ == "numpy":
        if name not in ARRAY:
            raise AttributeError(f"expressions cannot use the array attribute .{name}")
        return getattr(value, name)
    return field_of(value, name)


class Transformation:
    """An expression for `transform` that computes an output message's fields from the input message `m`.

    >>> Transformation("(m * 2, 'x')", [], Time).arguments(4)
    (8, 'x')
    >>> Transformation("math.sqrt(m)", ["math"], Time).arguments(4)
    [2.0]
    """

    def __init__(self, text: str, modules: Sequence[str], now: Callable[[], Time]) -> None:
        """Parse the expression.

        Args:
            text: the expression.
            modules: modules to import.
            now: function that returns the current time.

        Raises:
            ExpressionError: the expression is malformed, or uses a module that cannot be imported.
        """
        self.missing: dict[str, str] = {}
        """Unused modules that cannot be imported, with the reasons."""
        self._names: dict[str, Any] = {}
        for module in modules:
            try:
                self._names[module.partition(".")[0]] = module_for(module, now)
            except PiprosError as error:
                self.missing[module] = str(error)
        self._expression = Expression(text, fields=part_of)
        used = self._expression.names()
        for module, reason in self.missing.items():
            if module.partition(".")[0] in used:
                raise ExpressionError(text, 0, reason)

    def arguments(self, message: Any) -> Sequence[Any]:
        """Return the arguments for `publish`. Raises `ExpressionError` if the evaluation fails."""
        value = self._expression.value({**self._names, "m": message})
        return value if isinstance(value, (list, tuple)) else [value]


class Template:
    """Field values for `relay_field`, as YAML in which strings may be expressions that use the message `m`.

    A string is an expression if `m` and known functions are the only names in it. Other strings, and strings
    in lists, are literals. For example, `m.data`, `m.x * 2` and `len(m.data)` are evaluated, but `base_link`
    and `map` are not.

    >>> Template("{frame_id: map, seq: m + 1, stamp: {secs: 3}}").fields(4)
    {'frame_id': 'map', 'seq': 5, 'stamp': {'secs': 3}}
    """

    def __init__(self, text: str) -> None:
        """Parse the template.

        Raises:
            NotAMapping: the text is YAML, but not a mapping.
            pipros.safe.yaml.YamlError: the text is not valid YAML.
        """
        tree = load(text)
        if not isinstance(tree, dict):
            raise NotAMapping(f"the fields must be a YAML mapping such as 'data: m.x', got {tree!r}")
        self._tree = _with_expressions(tree)

    def fields(self, message: Any) -> dict[str, Any]:
        """Return the fields with their values. Raises `ExpressionError` if an expression fails."""
        return _evaluated(self._tree, {"m": message})


def _with_expressions(tree: Mapping[Any, Any]) -> dict[Any, Any]:
    return {key: _prepared(value) for key, value in tree.items()}


def _prepared(value: Any) -> Any:
    if isinstance(value, dict):
        return _with_expressions(value)
    if not isinstance(value, str) or (value.isidentifier() and value != "m"):
        return value
    try:
        expression = Expression(value, fields=part_of)
    except ExpressionError:
        return value
    names = expression.names() - {"m"}
    return expression if names <= FUNCTIONS.keys() - CONSTANTS.keys() else value


def _evaluated(tree: Mapping[Any, Any], names: Mapping[str, Any]) -> dict[Any, Any]:
    filled = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            value = _evaluated(value, names)
        elif isinstance(value, Expression):
            value = value.value(names)
        filled[key] = value
    return filled
