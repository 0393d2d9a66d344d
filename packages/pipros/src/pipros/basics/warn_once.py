"""Warnings about the machine rather than the user's program, printed once per process."""

from __future__ import annotations

import contextlib
import sys
from functools import cache

from pipros.basics.printable import printable

_LIMIT = 1_000


@cache
def warn_once(text: str) -> None:
    """Write `text` to standard error, unless it was already written. Never raises."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            print(printable(text, _LIMIT), file=sys.stderr, flush=True)
