"""Split a roslaunch command line into `name:=value` arguments and all other words."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics import names


def split_arguments(words: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """Return the `name:=value` words as a dictionary, and all other words. Values may be empty."""
    arguments: dict[str, str] = {}
    rest = []
    for word in words:
        if names.is_remapping_argument(word):
            name, _, value = word.partition(":=")
            arguments[name.strip()] = value.strip()
        else:
            rest.append(word)
    return arguments, rest
