"""Prints rule results in Noetic's format."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable

from pipros.basics.printable import printable_lines
from pipros.health.wtf.rules import Problem


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
