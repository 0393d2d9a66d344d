"""Messages whose values change over time, as YAML with expressions that cannot run Python code."""

from __future__ import annotations

from typing import Any

from pipros.safe.expr import Expression


class MessagePattern:
    """A YAML value in which strings that begin with "=" are expressions of `i` (count) and `t` (seconds).

    Strings that begin with "==" are not evaluated. See `pipros.safe.expr` for the functions, such as `sin`.

    Attributes:
        has_expressions: whether a string is an expression.

    >>> MessagePattern({"x": "=2 * i", "name": "arm", "all": ["=round(sin(t))"]}).value(3, 0.0)
    {'x': 6, 'name': 'arm', 'all': [0]}
    """

    def __init__(self, value: object) -> None:
        """Parse the expressions. Raise `ExpressionError` if one is malformed."""
        self._value = _parsed(value)
        self.has_expressions = self._value != value

    def value(self, number: int, seconds: float) -> Any:
        """Return the value with the results of the expressions. Raise `ExpressionError` if one fails."""
        return _evaluated(self._value, {"i": number, "t": seconds})


def _parsed(value: object) -> Any:
    if isinstance(value, dict):
        return {key: _parsed(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_parsed(item) for item in value]
    if isinstance(value, str) and value.startswith("=") and not value.startswith("=="):
        return Expression(value[1:])
    return value


def _evaluated(value: object, names: dict[str, float]) -> Any:
    if isinstance(value, dict):
        return {key: _evaluated(item, names) for key, item in value.items()}
    if isinstance(value, list):
        return [_evaluated(item, names) for item in value]
    return value.value(names) if isinstance(value, Expression) else value
