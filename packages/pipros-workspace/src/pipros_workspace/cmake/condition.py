"""Evaluate the conditions of `if()` and `while()`."""

from __future__ import annotations

import os
import re
from collections.abc import Container, MutableMapping, Sequence
from typing import Any

from pipros_workspace.cmake.language import split_list
from pipros_workspace.cmake.regex import search

Word = tuple[str, bool]
"""A word with variables replaced, and whether it was quoted.

A quoted word is neither a keyword nor a variable.
"""

_CLOSING: Word = (")", False)
_FALSE = frozenset(("", "0", "off", "no", "false", "n", "ignore", "notfound"))
_TRUE = frozenset(("1", "on", "yes", "true", "y"))
_NUMBER = re.compile(
    r"\s*([-+]?(?:0x[0-9a-f]+|(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?|inf(?:inity)?|nan))",
    re.IGNORECASE | re.ASCII,
)
_VERSION = re.compile(r"\d+(?:\.\d+){0,999}")
_NEWEST_POLICY = 142
_COMPARISONS = ("LESS", "GREATER", "EQUAL", "LESS_EQUAL", "GREATER_EQUAL")


def is_true(
    words: Sequence[Word],
    variables: MutableMapping[str, str],
    commands: Container[str] = (),
    targets: Container[str] = (),
    environment: Container[str] = (),
    cache: Container[str] = (),
) -> bool:
    """Return whether `if(words)` is true. `MATCHES` stores its matches in `CMAKE_MATCH_0`, …

    Args:
        commands, targets: the names for which `COMMAND` and `TARGET` are true.
        environment, cache: the names for which `DEFINED ENV{…}` and `DEFINED CACHE{…}` are true.

    Raises:
        ValueError: the words do not form a condition.
    """
    if not words:
        return False
    condition = _Condition(list(words), variables, commands, targets, environment, cache)
    value = condition.whole()
    condition.expect_end()
    return value


def is_on(value: str) -> bool:
    """Return whether CMake treats a variable with the value `value` as true."""
    lower = value.lower()
    return lower not in _FALSE and not lower.endswith("-notfound")


class _Condition:
    """Recursive descent parser.

    From the lowest to the highest precedence: AND and OR (from left to right), NOT, tests, parentheses.
    """

    def __init__(
        self,
        words: list[Word],
        variables: MutableMapping[str, str],
        commands: Container[str],
        targets: Container[str],
        environment: Container[str],
        cache: Container[str],
    ) -> None:
        self._words = words
        self._variables = variables
        self._commands = commands
        self._targets = targets
        self._environment = environment
        self._cache = cache

    def whole(self) -> bool:
        value = self._negated()
        while True:
            if self._skip_if("AND"):
                value = self._negated() and value
            elif self._skip_if("OR"):
                value = self._negated() or value
            else:
                return value

    def _negated(self) -> bool:
        # CMake treats a NOT without an operand, as in if(NOT $ENV{UNSET}), as the name of a variable.
        if len(self._words) > 1 and self._words[1] != _CLOSING and self._skip_if("NOT"):
            return not self._negated()
        if self._skip_if("("):
            value = self._words[:1] != [_CLOSING] and self.whole()
            if not self._skip_if(")"):
                raise ValueError("the condition lacks a closing parenthesis")
            return value
        return self._test()

    def _test(self) -> bool:
        word = self._next()
        name, is_quoted = word
        if self._words and not is_quoted and name in _ONE_WORD_TESTS:
            return self._one_word_test(name, self._next()[0])
        if self._words and not self._words[0][1]:
            operator = self._words[0][0]
            if operator in _TWO_WORD_TESTS or operator.startswith(("VERSION_", "STR")):
                self._words.pop(0)
                return self._two_word_test(word, operator, self._next())
        return self._truth(word)

    def _one_word_test(self, test: str, word: str) -> bool:
        if test == "DEFINED":
            if word.startswith("ENV{"):
                return word[4:-1] in self._environment
            if word.startswith("CACHE{"):
                return word[6:-1] in self._cache
            return word in self._variables
        if test == "TARGET":
            return word in self._targets
        if test == "COMMAND":
            return word.lower() in self._commands
        if test == "EXISTS":
            return os.path.exists(word)
        if test == "IS_DIRECTORY":
            return os.path.isdir(word)
        if test == "IS_SYMLINK":
            return os.path.islink(word)
        if test == "POLICY":
            return re.fullmatch(r"CMP\d{4}", word) is not None and int(word[3:]) <= _NEWEST_POLICY
        return test == "IS_ABSOLUTE" and os.path.isabs(word)

    def _two_word_test(self, left: Word, operator: str, right: Word) -> bool:
        first, second = self._value(left), self._value(right)
        if operator == "IN_LIST":
            elements = self._variables.get(right[0])
            return elements is not None and first in split_list(elements)
        if operator == "MATCHES":
            return search(second, first, self._variables)
        if operator == "IS_NEWER_THAN":
            return _is_newer(first, second)
        if operator == "PATH_EQUAL":
            return re.sub("//+", "/", first) == re.sub("//+", "/", second)
        relation = operator.removeprefix("VERSION_").removeprefix("STR")
        if operator.startswith("STR"):
            return _compare((first,), relation, (second,))
        if operator.startswith("VERSION_"):
            return _compare(_version(first), relation, _version(second))
        # As with sscanf(), text after the number is ignored.
        numbers = [_NUMBER.match(text) for text in (first, second)]
        if numbers[0] is None or numbers[1] is None:
            return False
        return _compare((_number(numbers[0]),), relation, (_number(numbers[1]),))

    def _value(self, word: Word) -> str:
        text, is_quoted = word
        return text if is_quoted else self._variables.get(text, text)

    def _truth(self, word: Word) -> bool:
        text = word[0]
        lower = text.lower()
        number = _NUMBER.fullmatch(text)
        if lower in _TRUE or number:
            return number is None or _number(number) != 0
        if lower in _FALSE or lower.endswith("-notfound") or word[1]:
            return False
        return is_on(self._variables.get(text, ""))

    def _next(self) -> Word:
        if not self._words:
            raise ValueError("the condition is incomplete")
        return self._words.pop(0)

    def _skip_if(self, keyword: str) -> bool:
        if self._words and self._words[0] == (keyword, False):
            self._words.pop(0)
            return True
        return False

    def expect_end(self) -> None:
        if self._words:
            raise ValueError(f"the condition has an unexpected [{self._words[0][0]}]")


_ONE_WORD_TESTS = ("DEFINED", "COMMAND", "EXISTS", "IS_DIRECTORY", "IS_ABSOLUTE", "TARGET", "POLICY", "TEST",
                   "IS_SYMLINK")  # fmt: skip
_TWO_WORD_TESTS = ("MATCHES", "IN_LIST", "IS_NEWER_THAN", "PATH_EQUAL", *_COMPARISONS)


def _is_newer(first: str, second: str) -> bool:
    """Return True if the first file is at least as new as the second, or if either does not exist."""
    try:
        return os.stat(first).st_mtime_ns >= os.stat(second).st_mtime_ns
    except OSError:
        return True


def _compare(left: Any, relation: str, right: Any) -> bool:
    """Compare two tuples whose elements are of the same type."""
    if relation == "EQUAL":
        return bool(left == right)
    if relation.startswith("LESS"):
        return bool(left < right) or (relation.endswith("EQUAL") and left == right)
    return bool(left > right) or (relation.endswith("EQUAL") and left == right)


def _number(match: re.Match[str]) -> float:
    text = match[1].lower()
    return float(int(text, 16)) if "0x" in text else float(text)


def _version(text: str) -> tuple[int, ...]:
    """Return the leading numbers of a version, without trailing zeros."""
    match = _VERSION.match(text)
    numbers = [int(part) for part in match[0].split(".")] if match else []
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)
