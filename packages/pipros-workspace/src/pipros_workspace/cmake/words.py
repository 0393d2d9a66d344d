"""Group a command's arguments by keyword."""

from __future__ import annotations

from collections.abc import Sequence


def sections(words: Sequence[str], keys: Sequence[str], switches: Sequence[str] = ()) -> dict[str, list[str]]:
    """Map each keyword to the words after it. Switches are left out.

    The words before the first keyword have the key "".
    """
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
    """Return the word that follows each of `names`. Omit names that do not occur in `words`."""
    return {name: words[words.index(name) + 1] for name in names if name in words[:-1]}
