"""Evaluate expressions from files and command lines without running Python code.

Python's own parser builds a syntax tree, which is then evaluated node by node. Nodes that are not on the
allow-list are rejected with their position. Methods are looked up in a fixed table (`methods.py`) and other
attributes do not exist, so an expression cannot reach the internals of the interpreter (CVE-2024-39835,
CVE-2024-39289). A caller may allow *fields* by passing a function that looks them up. The length of the text,
the depth, the number of steps and the size of every result are limited, so an expression cannot exhaust
memory or processor time.

`evaluate` is for `$(eval …)` and message filters, and `arithmetic` for the angles `rad(…)` and `deg(…)` in
parameter files.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from functools import partial
from typing import Any

from pipros.basics.syntax_trees import SYNTAX_TREES
from pipros.safe import guarded
from pipros.safe.expr_walk import (
    TYPE_NAMES,
    ExpressionError,
    FieldAccess,
    Function,
    Walk,
    column_of,
    first_column,
)

EXPRESSION_CHARACTERS = 4_000
"""Limit: the text of one `$(eval ...)`, message filter or CMake `math`. Beyond it, the expression is
refused.
"""


_ARITHMETIC = (
    ast.Constant, ast.Name, ast.UnaryOp, ast.UAdd, ast.USub,
    ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow,
)  # fmt: skip


def evaluate(
    text: str,
    *,
    names: Mapping[str, Any] | None = None,
    functions: Mapping[str, Function] | None = None,
    fields: FieldAccess | None = None,
) -> Any:
    """Return the value of an expression.

    The expression may contain literals, arithmetic, comparisons, `and`/`or`/`not`, `a if b else c`,
    subscripts, f-strings, comprehensions, the methods in `methods.py`, and calls to named functions. The
    functions and constants of `guarded.py`, which include `math`, are predefined; `functions` and `names` add
    others, or replace them. `map`, `filter` and `key=` take the name of a function. Generator expressions,
    `map` and similar functions return lists. `a.b` calls `fields(a, "b")`, if `fields` is given; if the
    result is callable, it is a method, which the expression must call. `hasattr(a, "b")` says whether it
    raises no `AttributeError`.

    Raises:
        ExpressionError: the text is malformed, or evaluation failed. If a called function raised an
            exception, that exception is the cause.

    >>> evaluate("rate * 2 if fast else max(rate, 1)", names={"rate": 5, "fast": True})
    10
    """
    return Expression(text, functions=functions, fields=fields).value(names or {})


class Expression:
    """An expression that is parsed once and evaluated many times.

    Takes the same arguments as `evaluate`, except `names`.

    Raises:
        ExpressionError: the text is malformed or too long.

    >>> Expression("a + b").value({"a": 1, "b": 2})
    3
    """

    def __init__(
        self,
        text: str,
        *,
        functions: Mapping[str, Function] | None = None,
        fields: FieldAccess | None = None,
    ) -> None:
        self._text = text
        self._tree = _parse(text)
        own: dict[str, Function] = {} if fields is None else {"hasattr": partial(_has_field, fields)}
        self._functions = {**own, **(functions or {})}
        self._fields = fields

    def names(self) -> set[str]:
        """Return all names in the expression: variables, functions and loop variables."""
        return {node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name)}

    def value(self, names: Mapping[str, object]) -> Any:
        """Evaluate the expression with the given names. Raises the same errors as `evaluate`."""
        budget = guarded.WorkBudget()
        walk = Walk(
            self._text,
            {**guarded.CONSTANTS, **names},
            {**guarded.FUNCTIONS, **budget.functions, **self._functions},
            self._fields,
            budget,
        )
        return walk.value(self._tree)


def _has_field(fields: FieldAccess, value: object, name: str) -> bool:
    """Return whether an expression may read `value.name`."""
    if name.startswith("_") and name not in TYPE_NAMES:
        return False
    try:
        fields(value, name)
    except AttributeError:
        return False
    return True


def arithmetic(text: str) -> float:
    """Return the value of an arithmetic expression of numbers and `pi`, such as `pi/2` or `-2*(pi+1)`.

    Raises:
        ExpressionError: the text is not such an expression.

    >>> round(arithmetic("pi/2"), 4)
    1.5708
    """
    tree = _parse(text)
    for node in ast.walk(tree):
        if isinstance(node, (ast.expr_context, *_ARITHMETIC)):
            continue
        raise ExpressionError(
            text, column_of(text, node), "only numbers, pi, + - * / ** and brackets are allowed"
        )
    value = Walk(text, {"pi": math.pi}, {}, None, guarded.WorkBudget()).value(tree)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ExpressionError(text, 0, f"{value!r} is not a number")
    try:
        return float(value)
    except OverflowError as error:
        raise ExpressionError(text, 0, str(error)) from None


def _parse(text: str) -> ast.expr:
    if len(text) > EXPRESSION_CHARACTERS:
        raise ExpressionError(text, 0, f"the expression is longer than {EXPRESSION_CHARACTERS} characters")
    try:
        with SYNTAX_TREES:
            return ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        column = first_column(text, error.lineno or 1) + error.offset - 1 if error.offset else 0
        raise ExpressionError(text, column, f"{error.msg}") from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise ExpressionError(text, 0, str(error) or "nested too deeply") from None
