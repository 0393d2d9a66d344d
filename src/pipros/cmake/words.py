"""Sorts the arguments of a command by its keywords."""

from __future__ import annotations

from collections.abc import Sequence


def sections(words: Sequence[str], keys: Sequence[str], switches: Sequence[str] = ()) -> dict[str, list[str]]:
    """The words behind each keyword, those before the first one under an empty key. Switches are left out."""
    found: dict[str, list[str]] = {key: [] for key in ("", *keys)}
    current = ""
    for word in words:
        if word in switches:
            continue
        if word in found:
            current = word
        else:
            found[current].append(word)
    return found


def options_of(words: list[str], *names: str) -> dict[str, str]:
    """The word behind each of the names that occurs."""
    return {name: words[words.index(name) + 1] for name in names if name in words[:-1]}
