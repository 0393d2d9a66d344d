"""The arguments to `catkin_make` that are meant for make: targets, variables and options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

_WITH_NUMBER = {"-j": "-j", "--jobs": "-j", "-l": "-l", "--load-average": "-l"}
_IGNORED = frozenset(
    ("-k", "--keep-going", "-s", "--silent", "--quiet", "-i", "--ignore-errors", "-w", "--print-directory",
     "--no-print-directory", "-O", "--output-sync", "--trace", "-r", "-R")
)  # fmt: skip
_FORCING = ("-B", "--always-make")


@dataclass(frozen=True, slots=True)
class MakeArguments:
    """Arguments for make.

    Attributes:
        jobs: options for the number of jobs and the load average, in short form.
        is_forced: whether to rebuild everything.
        unknown: options that are not supported.
    """

    targets: tuple[str, ...] = ()
    jobs: tuple[str, ...] = ()
    is_forced: bool = False
    unknown: tuple[str, ...] = ()

    def __add__(self, other: MakeArguments) -> MakeArguments:
        return MakeArguments(
            self.targets + other.targets,
            self.jobs + other.jobs,
            self.is_forced or other.is_forced,
            self.unknown + other.unknown,
        )


def read_make_arguments(words: Sequence[str]) -> MakeArguments:
    """Classify the arguments. Variables such as `VERBOSE=1` and options such as `--silent` are ignored."""
    found = MakeArguments()
    rest = list(words)
    while rest:
        word = rest.pop(0)
        name, sign, value = word.partition("=")
        if name in _WITH_NUMBER:
            if not sign and rest and _is_number(rest[0]):
                value = rest.pop(0)
            found += MakeArguments(jobs=(_WITH_NUMBER[name] + value,))
        elif word[:2] in ("-j", "-l") and _is_number(word[2:]):
            found += MakeArguments(jobs=(word,))
        elif word in _FORCING:
            found += MakeArguments(is_forced=True)
        elif word.startswith("-"):
            found += MakeArguments() if name in _IGNORED else MakeArguments(unknown=(word,))
        elif not sign:
            found += MakeArguments(targets=(word,))
    return found


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).isdecimal()
