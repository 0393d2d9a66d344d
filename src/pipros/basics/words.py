"""Split command lines into words."""

from __future__ import annotations

import shlex

from pipros.basics.windows import ON_WINDOWS


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
