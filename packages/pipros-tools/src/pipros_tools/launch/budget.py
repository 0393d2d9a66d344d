"""Limit the amount of data that a launch reads and generates.

Without limits, a 3 kB file could double a string 40 times, or include a file twice at each of 40 levels.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits, limit_text, process_limits


class OverBudget(PiprosError, ValueError):
    """A launch's files read or generate more than the limits allow."""


@dataclass(slots=True, eq=False, repr=False)
class LaunchBudget:
    """Resources that a launch's files have used so far.

    Attributes:
        read_bytes: size of all files and command outputs, plus the characters inserted by substitutions.
        includes: number of `<include>`s so far.
    """

    limits: Limits = field(default_factory=process_limits)
    read_bytes: int = 0
    includes: int = 0

    def add_bytes(self, count: int) -> None:
        """Count bytes read, or characters inserted by a substitution.

        Raises:
            OverBudget: the total exceeds the limit `launch_bytes`.
        """
        self.read_bytes += count
        if self.read_bytes > self.limits.launch_bytes:
            raise OverBudget(
                "the files of this launch and their substitutions are too large: "
                + limit_text("launch_bytes", self.limits.launch_bytes)
            )

    def add_include(self) -> None:
        """Count an `<include>`.

        Raises:
            OverBudget: the total exceeds the limit `launch_includes`.
        """
        self.includes += 1
        if self.includes > self.limits.launch_includes:
            raise OverBudget(
                "too many files are included: " + limit_text("launch_includes", self.limits.launch_includes)
            )
