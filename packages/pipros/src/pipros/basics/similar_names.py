"""Suggest known names that are similar to a mistyped name."""

from __future__ import annotations

from collections.abc import Iterable

_LONGEST = 1000
"""Number of characters of a name that are compared: a peer may send a name of any length."""


def near_names(name: str, known: Iterable[str]) -> list[str]:
    """Return up to three known names similar to `name`, the most similar first, or those that differ in case.

    >>> near_names("TOPIC", ["topic", "topics"])
    ['topic']
    """
    from difflib import get_close_matches

    names = sorted(known)
    same = [each for each in names if each.casefold() == name.casefold()]
    return same[:3] or get_close_matches(name[:_LONGEST], names, n=3, cutoff=0.7)


def similar_names(name: str, known: Iterable[str]) -> str:
    """Return a question that suggests up to three known names similar to `name`; empty if there are none.

    >>> similar_names("/ad_two_ints", ["/add_two_ints", "/rosout/get_loggers"])
    'Did you mean /add_two_ints?'
    """
    near = near_names(name, known)
    return f"Did you mean {' or '.join(near)}?" if near else ""
