"""The operators of safe expressions, and the error texts for syntax that is not allowed."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

from pipros.safe import guarded

BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Sub: operator.sub,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.RShift: operator.rshift,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
}
GROWING: Mapping[type[ast.operator], Callable[[guarded.WorkBudget, Any, Any], Any]] = {
    ast.Add: guarded.WorkBudget.add,
    ast.Mult: guarded.WorkBudget.multiply,
    ast.Mod: guarded.WorkBudget.modulo,
    ast.Pow: guarded.WorkBudget.power,
    ast.LShift: guarded.WorkBudget.shift_left,
}
UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Invert: operator.invert,
}
COMPARE: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda item, container: item in container,
    ast.NotIn: lambda item, container: item not in container,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
}
CONVERSIONS: Mapping[int, Callable[[Any], str]] = {ord("s"): str, ord("r"): repr, ord("a"): ascii}


def refusal(node: ast.AST) -> str:
    """Return the error text for a kind of AST node that is not allowed."""
    words = {
        "Lambda": "lambda is not allowed",
        "Starred": "* is not allowed",
        "NamedExpr": ":= is not allowed",
        "Await": "await is not allowed",
    }
    name = type(node).__name__
    return words.get(name, f"{name} is not allowed")
