"""Split command lines into words."""

from __future__ import annotations

import re
import shlex

from pipros.basics.windows import ON_WINDOWS

_PLAIN = re.compile(r"[\w:\\/.+-]+")


def quoted(word: str) -> str:
    """Quote a word of a command that a user may type; on Windows, for cmd and PowerShell.

    >>> print(quoted("pipros[course]"))
    'pipros[course]'
    """
    if not ON_WINDOWS:
        return shlex.quote(word)
    return word if _PLAIN.fullmatch(word) else f'"{word}"'


def split_words(text: str, quotes: str = "\"'", *, as_on_windows: bool | None = None) -> list[str]:
    """Split a command line into words, as a POSIX shell does. On Windows, a backslash separates folders.

    Args:
        quotes: the characters that quote words on Windows.
        as_on_windows: whether to split as on Windows; by default, whether this is Windows.

    Raises:
        ValueError: a quote is not closed.
    """
    if not (ON_WINDOWS if as_on_windows is None else as_on_windows):
        return shlex.split(text)
    lexer = shlex.shlex(text, posix=True, punctuation_chars=False)
    lexer.whitespace_split, lexer.commenters, lexer.escape, lexer.quotes = True, "", "", quotes
    return list(lexer)
