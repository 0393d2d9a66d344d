"""The regular expressions of CMake, by those of Python."""

from __future__ import annotations

import re
from collections.abc import MutableMapping
from functools import lru_cache

_PIECE = re.compile(r"\\.|\[\^?\]?[^\]]*\]|[{}]|\$$", re.DOTALL)


@lru_cache(maxsize=256)
def compiled(expression: str) -> re.Pattern[str]:
    """The pattern of an expression: a dot stands for any character, and braces for themselves.

    Raises:
        ValueError: it is none.
    """

    def translate(match: re.Match[str]) -> str:
        piece = match[0]
        if piece == "$":
            return r"\Z"
        if piece in "{}":
            return "\\" + piece
        # Letters behind a backslash have a meaning to Python only; in brackets so has a backslash.
        if piece[0] == "\\":
            return re.escape(piece[1])
        return piece.replace("\\", "\\\\").replace("[", r"\[").replace(r"\[", "[", 1)

    try:
        return re.compile(_PIECE.sub(translate, expression), re.DOTALL)
    except re.error as error:
        raise ValueError(f'the regular expression "{expression}" cannot be compiled: {error}') from None


def search(expression: str, text: str, variables: MutableMapping[str, str]) -> bool:
    """Whether the expression is found; what it found is left in `CMAKE_MATCH_0`, `CMAKE_MATCH_1` …

    Raises:
        ValueError: it is none.
    """
    match = compiled(expression).search(text)
    if match is not None:
        keep_groups(match, variables)
    return match is not None


def keep_groups(match: re.Match[str], variables: MutableMapping[str, str]) -> None:
    """Leaves a match and its groups in the variables that CMake has for them."""
    variables["CMAKE_MATCH_COUNT"] = str(match.re.groups)
    variables["CMAKE_MATCH_0"] = match[0]
    for number, group in enumerate(match.groups(""), 1):
        variables[f"CMAKE_MATCH_{number}"] = group


def replace(expression: str, replacement: str, text: str) -> str:
    """The text with every match replaced; `\\1` in the replacement is what the first group matched."""

    def expand(match: re.Match[str]) -> str:
        return re.sub(
            r"\\(.)",
            lambda found: (match[int(found[1])] or "") if found[1].isdigit() else found[1],
            replacement,
            flags=re.DOTALL,
        )

    return compiled(expression).sub(expand, text)
