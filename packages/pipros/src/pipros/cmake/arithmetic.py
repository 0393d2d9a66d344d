"""The command `math()`, for arithmetic with 64-bit integers."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

from pipros.basics.limits import limit_text
from pipros.cmake.scope import Scope

_TWO_TO_63 = 2**63
_LEADING_ZEROS = re.compile(r"\b0+(?=[0-9])")


def math(words: list[str], scope: Scope) -> None:
    """Execute `math(EXPR variable expression [OUTPUT_FORMAT …])`.

    Raises:
        ValueError: the expression is malformed, or divides by zero.
    """
    if words[:1] != ["EXPR"] or len(words) < 3:
        raise ValueError("must have the form math(EXPR variable expression)")
    # This also limits the nesting; the depth at which Python's parser fails differs between processes.
    limit = scope.limits.expression_characters
    if len(words[2]) > limit:
        raise ValueError(
            f"the expression has {len(words[2])} characters; {limit_text('expression_characters', limit)}"
        )
    try:
        # Unlike in Python, leading zeros are allowed.
        text = _LEADING_ZEROS.sub("", words[2].strip())
        value = _value(ast.parse(text, mode="eval").body)
    # the parser raises MemoryError if the expression is nested too deeply
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError(f'cannot parse the expression: "{words[2]}"') from None
    except ZeroDivisionError:
        raise ValueError(f"divide by zero in: {words[2]}") from None
    value = (value + _TWO_TO_63) % (2 * _TWO_TO_63) - _TWO_TO_63
    is_hexadecimal = words[3:] == ["OUTPUT_FORMAT", "HEXADECIMAL"]
    scope.values[words[1]] = hex(value % (2 * _TWO_TO_63)) if is_hexadecimal else str(value)


_BINARY: Mapping[type, Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: lambda left, right: abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1),
    ast.Mod: lambda left, right: abs(left) % abs(right) * (-1 if left < 0 else 1),
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
    # Processors use only the lowest six bits of the shift count.
    ast.LShift: lambda left, right: left << (right & 63),
    ast.RShift: lambda left, right: left >> (right & 63),
}


def _value(node: Any) -> int:
    match node:
        case ast.Constant(value=int(number)) if not isinstance(number, bool):
            if number >= _TWO_TO_63:
                raise ValueError(f"a numeric value is out of range: {number}")
            return number
        case ast.BinOp() if type(node.op) in _BINARY:
            return _BINARY[type(node.op)](_value(node.left), _value(node.right))
        case ast.UnaryOp(op=ast.USub()):
            return -_value(node.operand)
        case ast.UnaryOp(op=ast.UAdd()):
            return _value(node.operand)
        case ast.UnaryOp(op=ast.Invert()):
            return ~_value(node.operand)
    raise ValueError("the expression must consist of integers, + - * / % | & ^ ~ << >> and parentheses")
