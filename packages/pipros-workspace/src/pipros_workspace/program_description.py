"""Describe how rosrun and roslaunch start a program, for `pipros doctor FILE`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.printable import printable_lines
from pipros.basics.windows import ON_WINDOWS
from pipros_workspace.program_start import command_of, why_not_startable
from pipros_workspace.script_interpreter import interpreter_of


@dataclass(frozen=True, slots=True)
class ProgramDescription:
    """How a program is started.

    Attributes:
        program: the file.
        interpreter: the interpreter; empty if the program is started without one, or not at all.
        reason: the end of the sentence that `str` returns, such as `because it names no interpreter`; the
            whole sentence if the program cannot be started.
        is_startable: whether the program can be started.
    """

    program: Path
    interpreter: str
    reason: str
    is_startable: bool

    def __str__(self) -> str:
        if not self.is_startable:
            return printable_lines(self.reason)
        if not self.interpreter:
            return printable_lines(f"{self.program} is started {self.reason}")
        return printable_lines(f"{self.program} is started with {self.interpreter}, {self.reason}")

    def as_json(self) -> dict[str, object]:
        return {
            "program": str(self.program),
            "interpreter": self.interpreter or None,
            "reason": self.reason,
            "startable": self.is_startable,
        }


def describe_program(program: Path, environment: Mapping[str, str]) -> ProgramDescription:
    """Describe how a program is started in `environment`, without starting it.

    Raises:
        InvalidEnvironment: `PIPROS_INTERPRETER` has an unknown value.
    """
    if not program.is_file():
        return _not_startable(program, f"{program} is not a file")
    if not ON_WINDOWS and not os.access(program, os.X_OK):
        advice = f"rosrun and roslaunch do not find it; run: chmod +x {program}"
        return _not_startable(program, f"{program} is not executable, so {advice}")
    problem = why_not_startable(program, environment)
    if problem is not None:
        return _not_startable(program, problem)
    chosen = None if ON_WINDOWS else interpreter_of(program, environment)
    if chosen is not None and chosen.interpreter is not None:
        return ProgramDescription(program, chosen.interpreter, chosen.reason, is_startable=True)
    starter, *rest = command_of(program, variables=environment)
    if rest:
        return ProgramDescription(program, starter, "because it names no interpreter", is_startable=True)
    return ProgramDescription(program, "", "by the operating system", is_startable=True)


def _not_startable(program: Path, reason: str) -> ProgramDescription:
    return ProgramDescription(program, "", reason, is_startable=False)
