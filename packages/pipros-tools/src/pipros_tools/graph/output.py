"""Default output functions for `pipros_tools.graph`."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from pipros.basics.printable import listed


def to_stdout(text: str) -> None:
    print(text, flush=True)


def to_stderr(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def bullets(heading: str, entries: Iterable[str]) -> str:
    """Format a heading and one line per entry, as ROS commands do. Entries are made printable."""
    return "\n".join([heading, *(f" * {listed(entry)}" for entry in entries)])
