"""The number of random examples of a test: all in continuous integration, fewer on other machines."""

from tests.support.genuine import is_required

PART = 3
"""Outside continuous integration, which sets `CI`, one in `PART` examples is tried."""


def examples(count: int) -> int:
    """Return the number of examples to try: `count` in continuous integration, otherwise fewer."""
    return count if is_required() else max(1, count // PART)
