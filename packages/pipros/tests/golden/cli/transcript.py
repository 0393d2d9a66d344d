"""Transcripts: the output of a command on each stream, and its exit code.

A transcript is a text file. A line that starts with `$ ` is a command; the lines below it are its
outcome: `| ` a line on standard output, `! ` a line on standard error, `|~`/`!~` a last line without a
newline, `!!` the last line of a traceback, `= 2` the exit code if it is not 0. All other lines are
comments. Commands may begin with `NAME=value` and end with `< file`.

If genuine ROS fails with a traceback, pipros prints one line with the reason, and exits with the same code.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

_ASSIGNMENT = re.compile(r"([A-Z_]+)=(.*)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Command:
    """A typed command line, ready to be run."""

    line: str
    argv: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)
    stdin_file: str | None = None

    @classmethod
    def parse(cls, line: str) -> Command:
        words = shlex.split(line)
        environment = {}
        while assignment := _ASSIGNMENT.fullmatch(words[0]):
            environment[assignment[1]] = assignment[2]
            words.pop(0)
        stdin_file = None
        if len(words) > 2 and words[-2] == "<":
            stdin_file = words[-1]
            del words[-2:]
        return cls(line, tuple(words), environment, stdin_file)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a command."""

    stdout: str = ""
    stderr: str = ""
    code: int = 0


Mask = Callable[[str], str]


def mask_outcome(outcome: Outcome, masks: Mapping[str, str]) -> Outcome:
    """Return the outcome with placeholders for everything that varies between runs."""

    def masked(text: str) -> str:
        for pattern, name in masks.items():
            text = re.sub(pattern, name, text)
        return text

    return Outcome(masked(outcome.stdout), masked(outcome.stderr), outcome.code)


def _render_stream(sign: str, text: str) -> Iterator[str]:
    for line in text.splitlines(keepends=True):
        complete = line.endswith("\n")
        yield sign if line == "\n" else f"{sign}{' ' if complete else '~'}{line.removesuffix(chr(10))}"


_TRACEBACK = "Traceback (most recent call last):\n"


def is_breakdown(outcome: Outcome) -> bool:
    """Return True if the command ended with a traceback."""
    return _TRACEBACK in outcome.stderr


def _breakdown(traceback: str) -> str:
    """Return the first line of the exception that ended it."""
    return next(line for line in traceback.rpartition(_TRACEBACK)[2].splitlines() if line[:1].strip())


def render(command: Command, outcome: Outcome, stderr: str | None = None) -> str:
    """Return the block of a transcript for one command; `stderr` replaces its standard error."""
    lines = [f"$ {command.line}", *_render_stream("|", outcome.stdout)]
    if stderr is not None:
        lines.append(stderr)
    elif is_breakdown(outcome):
        before, _, traceback = outcome.stderr.partition(_TRACEBACK)
        lines += [*_render_stream("!", before), "!! " + _breakdown(traceback)]
    else:
        lines += _render_stream("!", outcome.stderr)
    if outcome.code:
        lines.append(f"= {outcome.code}")
    return "\n".join(lines) + "\n"


def split(text: str) -> list[tuple[str, str | None]]:
    """A transcript as (remarks and recorded lines, command) pieces, in order.

    Each element is a block of text; the second item is the command line when the block is a command's.
    """
    pieces: list[tuple[str, str | None]] = []
    block: list[str] = []
    command: str | None = None

    def flush() -> None:
        if block:
            pieces.append(("".join(block), command))
        block.clear()

    for line in text.splitlines(keepends=True):
        if line.startswith("$ "):
            flush()
            command = line[2:].rstrip("\n")
        elif command is not None and not line.startswith(("| ", "|~", "|\n", "! ", "!~", "!\n", "!! ", "= ")):
            flush()
            command = None
        block.append(line)
    flush()
    return pieces
