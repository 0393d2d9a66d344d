"""The programs started by the running test; the report of a failure shows the output of each."""

from __future__ import annotations

import time
from typing import Protocol

_HEAD_LINES, _TAIL_LINES = 100, 300
"""Of a longer output the first and last lines are shown."""


class Program(Protocol):
    """A process or a terminal of a test."""

    @property
    def is_running(self) -> bool: ...

    @property
    def transcript(self) -> list[str]:
        """Everything that it has printed so far, line by line."""


class Started:
    """Programs in the order in which they were started."""

    def __init__(self) -> None:
        self._programs: list[Program] = []
        self._began = time.monotonic()

    def begin_test(self) -> None:
        """Forget the programs of the previous test, except those that still run."""
        self._programs = [program for program in self._programs if program.is_running]
        self._began = time.monotonic()

    def add(self, program: Program) -> None:
        self._programs.append(program)

    def elapsed(self) -> str:
        """Return the time since the test began, as printed before each line."""
        return f"{time.monotonic() - self._began:7.2f}"

    def sections(self) -> list[tuple[str, str]]:
        """Return the command line and the output of each program."""
        return [
            (
                f"{'running' if program.is_running else 'ended'}: {program}",
                "\n".join(_shortened(program.transcript)),
            )
            for program in self._programs
        ]


def _shortened(lines: list[str]) -> list[str]:
    left_out = len(lines) - _HEAD_LINES - _TAIL_LINES
    if left_out <= 0:
        return lines
    return [*lines[:_HEAD_LINES], f"... {left_out} lines left out ...", *lines[-_TAIL_LINES:]]


STARTED = Started()
"""Those of the test that runs in this process; a process runs one test at a time."""
