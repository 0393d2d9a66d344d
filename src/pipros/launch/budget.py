"""Bounds what one launch reads and makes: 3 kB can double a text, or include a file twice, 40 times over."""

from __future__ import annotations

from dataclasses import dataclass, field

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits, limit_text, process_limits


class OverBudget(PiprosError, ValueError):
    """The files of a launch read or make more than the limits allow."""


@dataclass(slots=True)
class Budget:
    """What the files of one launch have read and made so far.

    Attributes:
        read_bytes: of all files and command outputs, and the characters that substitutions inserted.
        includes: `<include>`s so far.
    """

    limits: Limits = field(default_factory=process_limits)
    read_bytes: int = 0
    includes: int = 0

    def add_bytes(self, count: int) -> None:
        """Count bytes that were read, or characters that a substitution inserted.

        Raises:
            OverBudget: there are too many.
        """
        self.read_bytes += count
        if self.read_bytes > self.limits.launch_bytes:
            raise OverBudget(
                "the files of this launch, and what substitutions make of them, are too large: "
                + limit_text("launch_bytes", self.limits.launch_bytes)
            )

    def add_include(self) -> None:
        """Count an `<include>`.

        Raises:
            OverBudget: there are too many.
        """
        self.includes += 1
        if self.includes > self.limits.launch_includes:
            raise OverBudget(
                "too many files are included: " + limit_text("launch_includes", self.limits.launch_includes)
            )
