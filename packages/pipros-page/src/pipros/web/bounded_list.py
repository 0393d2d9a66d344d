"""Limit the length of lists that are sent to browsers, because other nodes control their content."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from pipros.basics.limits import process_limits
from pipros.web.limits import PageLimits

T = TypeVar("T")


def bounded_list(rows: Iterable[T], share: int = 1) -> list[T]:
    """Return the first rows, up to a total text size of `PageLimits.page_view_bytes` divided by `share`.

    >>> bounded_list(["/a", "/b"])
    ['/a', '/b']
    """
    left_bytes = process_limits().of(PageLimits).page_view_bytes // share
    found: list[T] = []
    for row in rows:
        left_bytes -= len(str(row))
        if left_bytes < 0:
            break
        found.append(row)
    return found
