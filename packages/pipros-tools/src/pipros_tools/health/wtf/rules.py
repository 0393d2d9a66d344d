"""`roswtf` rules, and the problems that they find."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.health.wtf.subject import Subject

Rule = tuple[Callable[[Subject], Any], str]
"""A function and its message. `%(name)s` in the message is replaced by one of `Subject.words`."""


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem that a rule found. It is a warning unless `is_error` is true."""

    is_error: bool
    text: str


def problems_of(subject: Subject, warnings: Sequence[Rule], errors: Sequence[Rule]) -> list[Problem]:
    """Apply rules to a subject. A rule whose function returns a falsy value has found no problem.

    A rule that raises another exception than `PiprosError` is a problem, and does not end the others.
    """
    problems = []
    for is_error, rules in ((False, warnings), (True, errors)):
        for function, text in rules:
            try:
                if result := function(subject):
                    problems.append(Problem(is_error, text_of(text, result, subject.words)))
            except PiprosError:  # the system cannot be examined
                raise
            except Exception as error:
                name = getattr(function, "__name__", repr(function))
                problems.append(Problem(True, f"the rule {name} failed: {type(error).__name__}: {error}"))
    return problems


def text_of(text: str, result: object, words: Mapping[str, object]) -> str:
    """Return a rule's message, followed by its result if that is a string or a list (one line per item)."""
    text %= words
    if isinstance(result, str):
        return text + result
    if isinstance(result, (list, tuple)):
        return text + "\n" + "".join(f" * {item}\n" for item in result)
    return text
