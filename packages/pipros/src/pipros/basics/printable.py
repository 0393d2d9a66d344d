"""Make text from peers and files safe for a terminal, a log, or one line of a listing."""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` would take milliseconds
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import IO

    Say = Callable[[str], object]
    """Writes text for the user."""

_CONTROLS = r"""
    \A\r?\x1b(?: \[K | \[\d+A\x1b\[J | \[2J\x1b\[;H | \]2;[^\x00-\x1f\x7f-\x9f]*\x07)  # clear; set a title
    | \A\r | \r(?=\n|\Z) | \x1b\[[\d;]*m  # a new line; a colour
    | ([\x00-\x08\x0b-\x1f\x7f-\x9f])
"""
"""Control characters in what commands print. Only those before the group are meant for terminals."""
_LONGEST_WORD = 5_000
_LONGEST_TEXT = 20_000
QUOTE_LIMIT = 200
"""Maximum length of quoted strings from peers; longer strings are truncated."""


def printable(value: object, limit: int = QUOTE_LIMIT) -> str:
    """Return `value` as one line. Control characters become escapes such as `\\x1b` and `\\n`.

    Values other than strings are converted by `str`. Text longer than `limit` characters is truncated and
    ends in `...`.

    >>> printable("a\\x1b[31mb\\nc"), printable("abcdef", limit=5)
    ('a\\\\x1b[31mb\\\\nc', 'ab...')
    """
    text = value if isinstance(value, str) else str(value)
    if len(text) > limit:
        text = text[: max(limit - 3, 0)] + "..."
    if text.isprintable():
        return text
    return "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode()
        for character in text
    )


def bounded(text: str) -> str:
    """Cut words of more than 5,000 characters, then a text of more than 20,000, and say how long they were.

    >>> bounded("no node " + "a" * 3_000_000)[-30:]
    'aaa... (of 3000000 characters)'
    """
    if len(text) <= _LONGEST_WORD:
        return text
    import re  # which programs that only import this module do not need

    word = rf"(?<!\S)\S{{{_LONGEST_WORD + 1},}}"  # begins where a word does, for a proportionate time
    text = re.sub(word, lambda found: _cut(found[0], _LONGEST_WORD // 2), text)
    return text if len(text) <= _LONGEST_TEXT else _cut(text, _LONGEST_TEXT)


def _cut(text: str, length: int) -> str:
    return f"{text[:length]}... (of {len(text)} characters)"


def listed(value: object) -> str:
    """Like `printable`, but without a length limit, for listings with long names."""
    return printable(value, sys.maxsize)


def printable_lines(text: str) -> str:
    """Return multi-line text without control characters other than line breaks and tabs.

    >>> printable_lines("a\\tb\\r\\nc")
    'a\\tb\\\\r\\nc'
    """
    return "\n".join("\t".join(map(listed, line.split("\t"))) for line in text.split("\n"))


def for_terminal(text: str) -> str:
    """Escape control characters that commands do not print themselves, but from file names or peers.

    >>> for_terminal("\\x1b[31mred\\x1b[0m \\x1b]52;c;aGk=\\x07"), for_terminal("\\r\\x1b[K")
    ('\\x1b[31mred\\x1b[0m \\\\x1b]52;c;aGk=\\\\x07', '\\r\\x1b[K')
    """
    if text == "\n" or text.isprintable():
        return text
    import re

    return re.sub(_CONTROLS, lambda found: listed(found[1]) if found[1] else found[0], text, flags=re.VERBOSE)


def write_line(stream: IO[str], line: str, end: str = "\n") -> None:
    """Write a line and flush it.

    Characters that the stream's encoding lacks are written as escapes such as `\\xe9`.

    Raises:
        OSError, ValueError: the stream cannot be written to, or is closed.
    """
    try:
        stream.write(line + end)
    except UnicodeEncodeError as error:  # nothing was written
        stream.write(line.encode(error.encoding, "backslashreplace").decode(error.encoding) + end)
    stream.flush()
