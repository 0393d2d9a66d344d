"""Warnings about the machine rather than the user's program, printed once per process."""

from __future__ import annotations

import contextlib
import sys

from pipros.basics.printable import printable

_LIMIT = 1_000
_written: set[str] = set()


def warn_once(text: str, about: str = "") -> None:
    """Write `text` to standard error, unless it was already written. Never raises.

    Args:
        about: the cause, for texts that differ although their cause is the same: only the first is written.
    """
    subject = about or text
    if subject in _written:
        return
    _written.add(subject)
    if sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            print(printable(text, _LIMIT), file=sys.stderr, flush=True)
