"""Arguments of commands that consist of keywords and what stands behind them."""

from __future__ import annotations

from collections.abc import Sequence


def sections(words: Sequence[str], keys: Sequence[str], switches: Sequence[str] = ()) -> dict[str, list[str]]:
    """The words sorted by the keyword that stands before them; those before the first one are below ''."""
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
    """The words behind the names given."""
    return {name: words[words.index(name) + 1] for name in names if name in words[:-1]}
