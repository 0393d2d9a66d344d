"""The programs that the running test has started. The report of a failure shows the output of each."""

import time
from typing import Protocol

_HEAD_LINES, _TAIL_LINES = 100, 300
"""Number of lines shown at the beginning and at the end of long output."""


class Program(Protocol):
    """A process or a terminal that a test has started."""

    @property
    def is_running(self) -> bool: ...

    @property
    def transcript(self) -> list[str]:
        """The lines printed so far."""


class Started:
    """Programs in the order in which they were started."""

    def __init__(self) -> None:
        self._programs: list[Program] = []
        self._began = time.monotonic()

    def begin_test(self) -> None:
        """Forget the programs of the previous test, except those that are still running."""
        self._programs = [program for program in self._programs if program.is_running]
        self._began = time.monotonic()

    def add(self, program: Program) -> None:
        self._programs.append(program)

    def elapsed(self) -> str:
        """Return the time in seconds since the test began, as shown before each line."""
        return f"{time.monotonic() - self._began:7.2f}"

    def sections(self) -> list[tuple[str, str]]:
        """Return a title with the command line, and the output, for each program."""
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
"""The programs of the test that is running in this process. A process runs one test at a time."""
