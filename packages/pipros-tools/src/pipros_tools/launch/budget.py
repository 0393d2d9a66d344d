"""Limit the amount of data that a launch reads and generates.

Without limits, a 3 kB file could double a string 40 times, or include a file twice at each of 40 levels.
"""

from __future__ import annotations

from dataclasses import dataclass

from pipros.basics.errors import PiprosError

LAUNCH_FILES_BYTES = 512 * 1024 * 1024
"""Limit: the files and command outputs that one launch reads, and the text that its substitutions insert,
together. Beyond it, the launch file is refused; the error names the file and line.
"""
LAUNCH_INCLUDES = 10_000
"""Limit: `<include>`s in one launch. Beyond it, the launch file is refused; the error names the file and
line.
"""


class OverBudget(PiprosError, ValueError):
    """A launch's files read or generate more than the limits allow."""


@dataclass(slots=True, eq=False, repr=False)
class LaunchBudget:
    """Resources that a launch's files have used so far.

    Attributes:
        read_bytes: size of all files and command outputs, plus the characters inserted by substitutions.
        includes: number of `<include>`s so far.
    """

    read_bytes: int = 0
    includes: int = 0

    def add_bytes(self, count: int) -> None:
        """Count bytes read, or characters inserted by a substitution.

        Raises:
            OverBudget: the total exceeds the limit `LAUNCH_FILES_BYTES`.
        """
        self.read_bytes += count
        if self.read_bytes > LAUNCH_FILES_BYTES:
            raise OverBudget(
                "the files of this launch and their substitutions are too large: "
                + f"the limit is {LAUNCH_FILES_BYTES} bytes"
            )

    def add_include(self) -> None:
        """Count an `<include>`.

        Raises:
            OverBudget: the total exceeds the limit `LAUNCH_INCLUDES`.
        """
        self.includes += 1
        if self.includes > LAUNCH_INCLUDES:
            raise OverBudget("too many files are included: " + f"the limit is {LAUNCH_INCLUDES}")
