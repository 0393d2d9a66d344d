"""Translate CMake's regular expressions to Python's, and limit the time of a match.

Like CMake's own matcher, `re` backtracks: `(a+)+$` needs days for 40 characters. A timer therefore ends a
match after `MATCH_S` of processor time; `re` calls Python's signal handlers while it matches. In threads
other than the main thread, and on Windows, this timer is not available, and the time is not limited.
"""

from __future__ import annotations

import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator, MutableMapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache

from pipros.basics.errors import PiprosError
from pipros_workspace.cmake.scope import check_length

MATCH_S = 1.0
"""Maximum processor time of one search, in seconds. Searches in real packages take microseconds."""

_SPECIAL = re.compile(r"\\.|\[\^?\]?[^\]]*\]|[{}]|\$$", re.DOTALL)


class TooSlow(PiprosError, ValueError):
    """A match takes too much processor time."""


class _TimeIsUp(Exception):
    """Raised by the signal handler."""


@dataclass(frozen=True, slots=True)
class Pattern:
    """A compiled expression.

    In the main thread, all methods raise `TooSlow` if the match takes more than `MATCH_S` of processor time.
    """

    expression: str
    _compiled: re.Pattern[str]

    def search(self, text: str) -> re.Match[str] | None:
        """Return the first match anywhere in the text."""
        with self._limited():
            return self._compiled.search(text)

    def fullmatch(self, text: str) -> re.Match[str] | None:
        """Return the match if the whole text matches."""
        with self._limited():
            return self._compiled.fullmatch(text)

    def matches(self, text: str) -> list[re.Match[str]]:
        """Return all matches."""
        with self._limited():
            return list(self._compiled.finditer(text))

    def sub(self, replace: Callable[[re.Match[str]], str], text: str) -> str:
        """Return the text with every match replaced."""
        with self._limited():
            return self._compiled.sub(replace, text)

    @contextmanager
    def _limited(self) -> Iterator[None]:
        is_main = threading.current_thread() is threading.main_thread()
        if sys.platform == "win32" or not is_main or not hasattr(signal, "setitimer"):
            yield
            return
        before = signal.signal(signal.SIGPROF, _end_match)
        try:
            signal.setitimer(signal.ITIMER_PROF, MATCH_S)
            yield
        except _TimeIsUp:
            raise TooSlow(
                f'the regular expression "{self.expression}" takes more than {MATCH_S:g} s of processor time'
                "; avoid repetitions inside repetitions"
            ) from None
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.signal(signal.SIGPROF, before)


def _end_match(*_: object) -> None:
    raise _TimeIsUp


@lru_cache(maxsize=256)
def compiled(expression: str) -> Pattern:
    """Return the pattern for an expression. As in CMake, `.` matches newlines and braces are literal.

    Raises:
        ValueError: the expression is invalid.
    """

    def translate(match: re.Match[str]) -> str:
        text = match[0]
        if text == "$":
            return r"\Z"
        if text in "{}":
            return "\\" + text
        # Unlike in Python, neither an escaped letter nor a backslash in brackets has a special meaning.
        if text[0] == "\\":
            return re.escape(text[1])
        return text.replace("\\", "\\\\").replace("[", r"\[").replace(r"\[", "[", 1)

    try:
        return Pattern(expression, re.compile(_SPECIAL.sub(translate, expression), re.DOTALL))
    except re.error as error:
        raise ValueError(f'the regular expression "{expression}" cannot be compiled: {error}') from None


def search(expression: str, text: str, variables: MutableMapping[str, str]) -> bool:
    """Return whether the expression matches anywhere; store the match and its groups in `CMAKE_MATCH_0`, ….

    Raises:
        ValueError: the expression is invalid, or the match takes too long.
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


def replace(expression: str, replacement: str, text: str) -> str:
    """Return the text with every match replaced. `\\1` in the replacement is the first group.

    Raises:
        ValueError: the expression is invalid, takes too long or matches an empty string, the replacement
            refers to a group without a match, or the result would be too long.
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
        check_length(len(replacement))
        expanded = re.sub(
            r"\\(.)",
            lambda found: group(match, int(found[1])) if found[1].isdigit() else found[1],
            replacement,
            flags=re.DOTALL,
        )
        made += len(expanded)
        check_length(made)
        return expanded

    return compiled(expression).sub(expand, text)
