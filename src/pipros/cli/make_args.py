"""The words on a command line of `catkin_make` that are for make: targets, variables and options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

_WITH_NUMBER = {"-j": "-j", "--jobs": "-j", "-l": "-l", "--load-average": "-l"}
_WITHOUT_MEANING = frozenset(
    ("-k", "--keep-going", "-s", "--silent", "--quiet", "-i", "--ignore-errors", "-w", "--print-directory",
     "--no-print-directory", "-O", "--output-sync", "--trace", "-r", "-R")
)  # fmt: skip
_FORCING = ("-B", "--always-make")


@dataclass(frozen=True, slots=True)
class MakeWords:
    """What was said to make.

    Attributes:
        jobs: how many jobs, in the short form of the options.
        is_forced: whether everything is to be made anew.
        unknown: options that nobody knows.
    """

    targets: tuple[str, ...] = ()
    jobs: tuple[str, ...] = ()
    is_forced: bool = False
    unknown: tuple[str, ...] = ()

    def __add__(self, other: MakeWords) -> MakeWords:
        return MakeWords(
            self.targets + other.targets,
            self.jobs + other.jobs,
            self.is_forced or other.is_forced,
            self.unknown + other.unknown,
        )


def read_make_words(words: Sequence[str]) -> MakeWords:
    """Sorts the words. Variables (`VERBOSE=1`) mean nothing where nothing is compiled."""
    found = MakeWords()
    rest = list(words)
    while rest:
        word = rest.pop(0)
        name, sign, value = word.partition("=")
        if name in _WITH_NUMBER:
            if not sign and rest and _is_number(rest[0]):
                value = rest.pop(0)
            found += MakeWords(jobs=(_WITH_NUMBER[name] + value,))
        elif word[:2] in ("-j", "-l") and _is_number(word[2:]):
            found += MakeWords(jobs=(word,))
        elif word in _FORCING:
            found += MakeWords(is_forced=True)
        elif word.startswith("-"):
            found += MakeWords() if name in _WITHOUT_MEANING else MakeWords(unknown=(word,))
        elif not sign:
            found += MakeWords(targets=(word,))
    return found


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).isdecimal()
