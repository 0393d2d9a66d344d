"""Translate CMake's regular expressions to Python's."""

from __future__ import annotations

import re
from collections.abc import MutableMapping
from functools import lru_cache

from pipros.basics.limits import Limits
from pipros.cmake.scope import check_length

_SPECIAL = re.compile(r"\\.|\[\^?\]?[^\]]*\]|[{}]|\$$", re.DOTALL)


@lru_cache(maxsize=256)
def compiled(expression: str) -> re.Pattern[str]:
    """Return the Python pattern for an expression. As in CMake, `.` matches newlines and braces are literal.

    Raises:
        ValueError: the expression is invalid.
    """

    def translate(match: re.Match[str]) -> str:
        text = match[0]
        if text == "$":
            return r"\Z"
        if text in "{}":
            return "\\" + text
        # An escaped letter and a backslash in brackets have a special meaning only in Python.
        if text[0] == "\\":
            return re.escape(text[1])
        return text.replace("\\", "\\\\").replace("[", r"\[").replace(r"\[", "[", 1)

    try:
        return re.compile(_SPECIAL.sub(translate, expression), re.DOTALL)
    except re.error as error:
        raise ValueError(f'the regular expression "{expression}" cannot be compiled: {error}') from None


def search(expression: str, text: str, variables: MutableMapping[str, str]) -> bool:
    """Return whether the expression matches anywhere; store the match and its groups in `CMAKE_MATCH_0`, ….

    Raises:
        ValueError: the expression is invalid.
    """
    match = compiled(expression).search(text)
    if match is not None:
        keep_groups(match, variables)
    return match is not None


def keep_groups(match: re.Match[str], variables: MutableMapping[str, str]) -> None:
    """Store a match and its groups in `CMAKE_MATCH_COUNT`, `CMAKE_MATCH_0`, …."""
    variables["CMAKE_MATCH_COUNT"] = str(match.re.groups)
    variables["CMAKE_MATCH_0"] = match[0]
    for number, group in enumerate(match.groups(""), 1):
        variables[f"CMAKE_MATCH_{number}"] = group


def require_text(match: re.Match[str], mode: str) -> None:
    """Raise ValueError if `string(REGEX mode)` matched an empty string, which CMake rejects."""
    if match.start() == match.end():
        raise ValueError(f"sub-command REGEX, mode {mode}: the expression matched an empty string")


def replace(expression: str, replacement: str, text: str, limits: Limits) -> str:
    """Return the text with every match replaced. `\\1` in the replacement is the first group.

    Raises:
        ValueError: the expression is invalid or matches an empty string, the replacement refers to a group
            without a match, or the result would be too long.
    """
    made = 0

    def group(match: re.Match[str], number: int) -> str:
        text = match[number] if number <= match.re.groups else None
        if text is None:
            raise ValueError(f'the replacement "{replacement}" contains an out-of-range escape')
        return text

    def expand(match: re.Match[str]) -> str:
        nonlocal made
        require_text(match, "REPLACE")
        check_length(len(replacement), limits)
        expanded = re.sub(
            r"\\(.)",
            lambda found: group(match, int(found[1])) if found[1].isdigit() else found[1],
            replacement,
            flags=re.DOTALL,
        )
        made += len(expanded)
        check_length(made, limits)
        return expanded

    return compiled(expression).sub(expand, text)
