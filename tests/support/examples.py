"""The number of random examples of a test: all in continuous integration, fewer on other machines."""

from __future__ import annotations

from tests.support.genuine import is_required

PART = 3
"""One in so many examples is tried outside continuous integration, which sets `CI`."""


def examples(count: int) -> int:
    """Return the number of examples to try in place of `count`."""
    return count if is_required() else max(1, count // PART)
