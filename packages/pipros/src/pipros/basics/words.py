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


def split_words(text: str) -> list[str]:
    """Split a command line into words, as a POSIX shell does. On Windows, a backslash separates folders.

    Raises:
        ValueError: a quote is not closed.
    """
    if not ON_WINDOWS:
        return shlex.split(text)
    lexer = shlex.shlex(text, posix=True, punctuation_chars=False)
    lexer.whitespace_split, lexer.commenters, lexer.escape = True, "", ""
    return list(lexer)
