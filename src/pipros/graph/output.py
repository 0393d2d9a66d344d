"""Where functions of this room write by default what a person should know."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable

from pipros.printable import listed

Say = Callable[[str], object]
"""Takes one text for a person."""


def to_stdout(text: str) -> None:
    print(text, flush=True)


def to_stderr(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def bullets(heading: str, entries: Iterable[str]) -> str:
    """A heading and one line for each entry, as ROS commands list things. Entries may be a peer's words."""
    return "\n".join([heading, *(f" * {listed(entry)}" for entry in entries)])
