"""`roswtf` rules, the problems that they find, and their output in Noetic's format."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable_lines
from pipros_tools.health.finding import Finding, FindingSeverity
from pipros_tools.health.wtf.subject import Subject

Rule = tuple[Callable[[Subject], Any], str]
"""A function and its message. `%(name)s` in the message is replaced by one of `Subject.words`."""


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem that a rule found. It is a warning unless `is_error` is true."""

    is_error: bool
    text: str


def as_problems(findings: Iterable[Finding]) -> list[Problem]:
    """Return findings of `pipros doctor` as problems of roswtf, each with its remedy."""
    return [
        Problem(found.severity is FindingSeverity.ERROR, f"{found.summary}. {found.cure}")
        for found in findings
    ]


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


def print_problems(problems: Iterable[Problem]) -> None:
    """Print the warnings, then the errors, in colour on a terminal."""
    is_coloured = sys.stdout.isatty() and not os.environ.get("NO_COLOR")
    warning, error = (
        ("\x1b[1mWARNING\x1b[0m", "\x1b[31m\x1b[1mERROR\x1b[0m") if is_coloured else ("WARNING", "ERROR")
    )
    warnings: list[str] = []
    errors: list[str] = []
    for problem in problems:
        (errors if problem.is_error else warnings).append(printable_lines(problem.text))
    if not errors and not warnings:
        print("No errors or warnings")
    if warnings:
        print(
            f"Found {len(warnings)} warning(s).\n"
            "Warnings are things that may be just fine, but are sometimes at fault\n"
        )
        for text in warnings:
            print(f"{warning} {text}")
        print()
    if errors:
        print(f"Found {len(errors)} error(s).\n")
        for text in errors:
            print(f"{error} {text}")
