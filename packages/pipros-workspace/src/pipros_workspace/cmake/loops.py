"""Evaluate the arguments of `foreach()`: its loop variables, and their values in each iteration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import zip_longest

from pipros_workspace.cmake.language import split_list


def rounds(words: Sequence[str], variables: Mapping[str, str]) -> tuple[list[str], Iterable[tuple[str, ...]]]:
    """Return a loop's variables, and their values in each iteration.

    Raises:
        ValueError, IndexError: the arguments are wrong.
    """
    if not words:
        raise ValueError("no loop variable")
    if "IN" in words[1:] and words[words.index("IN") + 1 :][:1] == ["ZIP_LISTS"]:
        place = words.index("IN")
        return _zipped(list(words[:place]), [_elements(name, variables) for name in words[place + 2 :]])
    variable, *rest = words
    if rest[:1] == ["RANGE"]:
        return [variable], ((str(number),) for number in _range([int(word) for word in rest[1:]]))
    if rest[:1] == ["IN"]:
        rest = _in(rest[1:], variables)
    return [variable], [(word,) for word in rest]


def _in(words: Sequence[str], variables: Mapping[str, str]) -> list[str]:
    found: list[str] = []
    kind = ""
    for word in words:
        if word in ("LISTS", "ITEMS"):
            kind = word
        elif not kind:
            raise ValueError(f'unknown argument: "{word}"')
        elif kind == "LISTS":
            found += _elements(word, variables)
        else:
            found.append(word)
    return found


def _range(numbers: list[int]) -> range:
    """Return the range that `numbers` specifies. As in CMake, it includes the last number.

    Without a step, it counts up or down by 1.
    """
    first, last = (0, *numbers, 0)[:2] if len(numbers) < 2 else numbers[:2]
    direction = 1 if last >= first else -1
    step = numbers[2] if len(numbers) > 2 and numbers[2] else direction
    if step * direction <= 0:
        raise ValueError(f"incorrect range specification: start {first}, stop {last}, step {step}")
    return range(first, last + direction, step)


def _zipped(names: list[str], lists: list[list[str]]) -> tuple[list[str], Iterable[tuple[str, ...]]]:
    if len(names) == 1:
        names = [f"{names[0]}_{number}" for number in range(len(lists))]
    return names, zip_longest(*lists, fillvalue="")


def _elements(name: str, variables: Mapping[str, str]) -> list[str]:
    text = variables.get(name, "")
    return split_list(text) if text else []
