"""`string()`, `math()` and `separate_arguments()`."""

from __future__ import annotations

import ast
import hashlib
import operator
import random
import re
import shlex
import time
from collections.abc import Callable, Mapping
from typing import Any

from pipros.workspace.cmake import regex
from pipros.workspace.cmake.configure import configured
from pipros.workspace.cmake.scope import Scope, Unsupported


def carry_out(words: list[str], scope: Scope) -> None:
    """Carries out `string(words)`.

    Raises:
        ValueError: the words make no sense.
        Unsupported: a subcommand that is not known here.
    """
    operation, *rest = words or [""]
    action = _OPERATIONS.get(operation)
    try:
        if action is not None:
            action(rest, scope)
        elif operation in ("MD5", "SHA1", "SHA224", "SHA256", "SHA384", "SHA512"):
            output, text = rest
            scope.values[output] = hashlib.new(operation.lower(), text.encode()).hexdigest()
        else:
            raise Unsupported(f"string({operation})")
    except IndexError:
        raise ValueError(f"sub-command {operation} has too few arguments") from None


def _find(words: list[str], scope: Scope) -> None:
    text, wanted, output = words[0], words[1], words[2]
    scope.values[output] = str((str.rfind if words[3:] == ["REVERSE"] else str.find)(text, wanted))


def _replace(words: list[str], scope: Scope) -> None:
    scope.values[words[2]] = "".join(words[3:]).replace(words[0], words[1])


def _regex(words: list[str], scope: Scope) -> None:
    kind, expression = words[0], words[1]
    if kind == "REPLACE":
        scope.values[words[3]] = regex.replace(expression, words[2], "".join(words[4:]))
        return
    output, text = words[2], "".join(words[3:])
    matches = list(regex.compiled(expression).finditer(text))
    if kind == "MATCH":
        matches = matches[:1]
    elif kind != "MATCHALL":
        raise ValueError(f"sub-command REGEX does not recognize mode {kind}")
    for match in matches:
        regex.keep_groups(match, scope.values)
    scope.values[output] = ";".join(match[0] for match in matches)


def _append(words: list[str], scope: Scope) -> None:
    scope.values[words[0]] = scope.values.get(words[0], "") + "".join(words[1:])


def _prepend(words: list[str], scope: Scope) -> None:
    scope.values[words[0]] = "".join(words[1:]) + scope.values.get(words[0], "")


def _concat(words: list[str], scope: Scope) -> None:
    scope.values[words[0]] = "".join(words[1:])


def _join(words: list[str], scope: Scope) -> None:
    scope.values[words[1]] = words[0].join(words[2:])


def _change(change: Callable[[str], str]) -> Callable[[list[str], Scope], None]:
    def carry_out(words: list[str], scope: Scope) -> None:
        scope.values[words[1]] = change(words[0])

    return carry_out


def _substring(words: list[str], scope: Scope) -> None:
    text, begin, length = words[0], int(words[1]), int(words[2])
    if not 0 <= begin <= len(text):
        raise ValueError(f"sub-command SUBSTRING: begin index: {begin} is out of range 0 - {len(text)}")
    scope.values[words[3]] = text[begin:] if length < 0 else text[begin : begin + length]


def _repeat(words: list[str], scope: Scope) -> None:
    text, count = words[0], int(words[1])
    if len(text) * count > _LENGTH_LIMIT:
        raise ValueError(f"sub-command REPEAT would make a text of more than {_LENGTH_LIMIT} characters")
    scope.values[words[2]] = text * count


_LENGTH_LIMIT = 1_000_000


def _compare(words: list[str], scope: Scope) -> None:
    compare: dict[str, Callable[[str, str], bool]] = {
        "LESS": operator.lt,
        "GREATER": operator.gt,
        "EQUAL": operator.eq,
        "NOTEQUAL": operator.ne,
        "LESS_EQUAL": operator.le,
        "GREATER_EQUAL": operator.ge,
    }
    if words[0] not in compare:
        raise ValueError(f"sub-command COMPARE does not recognize mode {words[0]}")
    scope.values[words[3]] = "1" if compare[words[0]](words[1], words[2]) else "0"


def _ascii(words: list[str], scope: Scope) -> None:
    scope.values[words[-1]] = "".join(chr(int(word)) for word in words[:-1])


def _configure(words: list[str], scope: Scope) -> None:
    scope.values[words[1]] = configured(words[0], scope, at_only="@ONLY" in words[2:])


def _timestamp(words: list[str], scope: Scope) -> None:
    rest = [word for word in words[1:] if word != "UTC"]
    moment = time.gmtime() if "UTC" in words else time.localtime()
    scope.values[words[0]] = time.strftime(rest[0] if rest else "%Y-%m-%dT%H:%M:%S", moment)


def _random(words: list[str], scope: Scope) -> None:
    options = dict(zip(words[:-1:2], words[1:-1:2], strict=False))
    alphabet = options.get("ALPHABET", "qwertyuiopasdfghjklzxcvbnmQWERTYUIOPASDFGHJKLZXCVBNM0123456789")
    chooser = random.Random(options.get("RANDOM_SEED"))  # noqa: S311  # names of files, no secrets
    scope.values[words[-1]] = "".join(chooser.choices(alphabet, k=int(options.get("LENGTH", "5"))))


_OPERATIONS: Mapping[str, Callable[[list[str], Scope], None]] = {
    "FIND": _find,
    "REPLACE": _replace,
    "REGEX": _regex,
    "APPEND": _append,
    "PREPEND": _prepend,
    "CONCAT": _concat,
    "JOIN": _join,
    "TOLOWER": _change(str.lower),
    "TOUPPER": _change(str.upper),
    "LENGTH": _change(lambda text: str(len(text.encode()))),
    "STRIP": _change(lambda text: text.strip()),
    "MAKE_C_IDENTIFIER": _change(
        lambda text: re.sub(r"^(?=\d)", "_", re.sub(r"\W", "_", text, flags=re.ASCII))
    ),
    "HEX": _change(lambda text: text.encode().hex()),
    "SUBSTRING": _substring,
    "REPEAT": _repeat,
    "COMPARE": _compare,
    "ASCII": _ascii,
    "CONFIGURE": _configure,
    "TIMESTAMP": _timestamp,
    "RANDOM": _random,
}


def math(words: list[str], scope: Scope) -> None:
    """Carries out `math(EXPR variable expression [OUTPUT_FORMAT …])`.

    Raises:
        ValueError: the expression is none, or divides by zero.
    """
    if words[:1] != ["EXPR"] or len(words) < 3:
        raise ValueError("has the form math(EXPR variable expression)")
    try:
        value = _value(ast.parse(words[2].strip(), mode="eval").body)
    except (SyntaxError, RecursionError):
        raise ValueError(f'cannot parse the expression: "{words[2]}"') from None
    except ZeroDivisionError:
        raise ValueError(f"divide by zero in: {words[2]}") from None
    value = (value + _TWO_TO_63) % (2 * _TWO_TO_63) - _TWO_TO_63
    is_hexadecimal = words[3:] == ["OUTPUT_FORMAT", "HEXADECIMAL"]
    scope.values[words[1]] = hex(value % (2 * _TWO_TO_63)) if is_hexadecimal else str(value)


_TWO_TO_63 = 2**63

_BINARY: Mapping[type, Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: lambda left, right: abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1),
    ast.Mod: lambda left, right: abs(left) % abs(right) * (-1 if left < 0 else 1),
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
    ast.LShift: lambda left, right: left << min(right, 64),
    ast.RShift: lambda left, right: left >> min(right, 64),
}


def _value(node: Any) -> int:
    match node:
        case ast.Constant(value=int(number)) if not isinstance(number, bool):
            return number
        case ast.BinOp() if type(node.op) in _BINARY:
            return _BINARY[type(node.op)](_value(node.left), _value(node.right))
        case ast.UnaryOp(op=ast.USub()):
            return -_value(node.operand)
        case ast.UnaryOp(op=ast.UAdd()):
            return _value(node.operand)
        case ast.UnaryOp(op=ast.Invert()):
            return ~_value(node.operand)
    raise ValueError("knows whole numbers, + - * / % | & ^ ~ << >> and brackets only")


def separate_arguments(words: list[str], scope: Scope) -> None:
    """Carries out `separate_arguments(variable [mode] [arguments])`.

    Raises:
        ValueError: no variable, or a quote is open.
    """
    if not words:
        raise ValueError("must be given at least one argument")
    name, *rest = words
    if not rest:
        scope.values[name] = scope.values.get(name, "").replace(" ", ";")
        return
    scope.values[name] = ";".join(shlex.split(" ".join(word for word in rest[1:] if word != "PROGRAM")))
