"""Suggest known names that are similar to a mistyped name."""

from __future__ import annotations

from collections.abc import Iterable


def similar_names(name: str, known: Iterable[str]) -> str:
    """Return a question that suggests up to three known names similar to `name`; empty if there are none.

    >>> similar_names("/ad_two_ints", ["/add_two_ints", "/rosout/get_loggers"])
    'Did you mean /add_two_ints?'
    """
    from difflib import get_close_matches

    near = get_close_matches(name, sorted(known), n=3, cutoff=0.7)
    return f"Did you mean {' or '.join(near)}?" if near else ""
