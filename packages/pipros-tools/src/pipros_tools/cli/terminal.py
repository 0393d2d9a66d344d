"""Output on a terminal: colours, aligned columns, and blocks of lines that are rewritten in place.

Output to pipes and files has none of these, so scripts read exactly the text that Noetic prints.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

# type checkers treat this as True; importing `typing` takes milliseconds
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import IO

CYAN = "36"
DIM = "2"


def is_terminal(stream: IO[str] | None = None) -> bool:
    """Return whether a stream, by default standard output, is a terminal that supports escape sequences."""
    stream = sys.stdout if stream is None else stream
    return stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"


def has_colours(stream: IO[str] | None = None) -> bool:
    """Return True on a terminal, unless `NO_COLOR` is set (https://no-color.org)."""
    return is_terminal(stream) and not os.environ.get("NO_COLOR")


def aligned(rows: Sequence[Sequence[str]], colours: Sequence[str] = ()) -> list[str]:
    """Format rows of cells as lines with aligned columns.

    Args:
        colours: the colour of each column, such as `CYAN`; an empty string for no colour. Ignored if
            `has_colours` returns False.

    >>> aligned([["/scan", "a/Scan"], ["/tf", "b/TF"]])
    ['/scan a/Scan', '/tf   b/TF']
    """
    if not rows:
        return []
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    is_coloured = bool(colours) and has_colours()
    lines = []
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=True)]
        cells[-1] = row[-1]
        if is_coloured:
            cells = [
                f"\x1b[{colour}m{cell}\x1b[0m" if colour else cell
                for cell, colour in zip(cells, colours, strict=True)
            ]
        lines.append(" ".join(cells))
    return lines


def table(rows: Sequence[Sequence[str]], colours: Sequence[str]) -> list[str]:
    """Format rows as lines: aligned and coloured on a terminal, otherwise separated by single spaces."""
    return aligned(rows, colours) if is_terminal() else [" ".join(row) for row in rows]


def paragraph(text: str, *, indent: int, taken: int = 0) -> str:
    """Wrap text at word boundaries to the terminal's width. Without a terminal, return it unchanged.

    Args:
        indent: the indentation of the second and later lines, in columns.
        taken: columns already used in the first line.
    """
    if not is_terminal():
        return text
    import shutil
    import textwrap

    width = max(shutil.get_terminal_size().columns, taken + 20)
    lines = textwrap.wrap(
        text,
        width,
        initial_indent=" " * taken,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines)[taken:]


@contextmanager
def passing_note(text: str) -> Iterator[None]:
    """Show a line on standard error while the block runs, if standard error is a terminal."""
    if not is_terminal(sys.stderr):
        yield
        return
    print(text, end="", file=sys.stderr, flush=True)
    try:
        yield
    finally:
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)


class LiveBlock:
    """Printer for blocks of lines. On a terminal, each block replaces the previous block."""

    def __init__(self) -> None:
        self._is_terminal = is_terminal()
        self._height = 0

    def show(self, text: str) -> None:
        up = f"\x1b[{self._height}A\x1b[J" if self._height else ""
        print(up + text, flush=True)
        self._height = self._height_of(text) if self._is_terminal else 0

    def say(self, text: str) -> None:
        """Print a permanent line; the next block appears below it."""
        print(text, flush=True)
        self._height = 0

    def _height_of(self, text: str) -> int:
        """Return the number of screen lines of a block, or 0 if its start has scrolled off the screen."""
        import shutil

        columns, lines = shutil.get_terminal_size()
        height = sum(max(1, -(-len(line) // columns)) for line in text.split("\n"))
        return height if height < lines else 0
