"""The frame of every command: options as ROS prints them, errors as one line, a quiet end.

Interpreter start-up is most of what a person waits for, so nothing here imports what only some
commands need.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from optparse import OptionParser

from pipros.cli.streams import discard_output
from pipros.errors import PiprosError, Unreachable
from pipros.graph.errors import NO_MASTER

USAGE_ERROR = 64
"""EX_USAGE of sysexits.h: what ROS commands return for a missing or unknown subcommand."""

Subcommand = Callable[[Sequence[str]], int]


class CommandError(PiprosError):
    """The command cannot do what was asked. The text is printed after `ERROR: `."""


class MasterUnreachable(CommandError):
    """No master answers at ROS_MASTER_URI."""

    def __init__(self, reason: str = "") -> None:
        self.reason = reason
        super().__init__(NO_MASTER)


def option_parser(command: str, usage: str, description: str | None = None) -> OptionParser:
    """Options the way ROS commands have them: `Usage: rostopic list [/namespace]`, mistakes end with 2."""
    return OptionParser(usage=f"usage: {command} {usage}", prog=command, description=description)


def dispatch(subcommands: Mapping[str, str], argv: Sequence[str], overview: str, code: int) -> int:
    """Runs the subcommand that the first argument names; prints the overview when it names none.

    The subcommands are `module:function`, so that a command imports only the one that is asked for.
    """
    if not argv or argv[0] not in subcommands:
        print(overview)
        return code
    module, _, function = subcommands[argv[0]].partition(":")
    subcommand: Subcommand = getattr(import_module(module), function)
    return subcommand(argv[1:])


def run(body: Callable[[], int], *, error_code: int = 1) -> int:
    """Runs a command to its exit code, with the ends that all commands share.

    An error is printed on standard error and ends with `error_code`. Ctrl-C ends with 0 and without a
    traceback, as Noetic's commands do. A reader that closed the pipe (`| head`) ends the command quietly.
    """
    try:
        code = body()
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _quiet_end()
    except BrokenPipeError:
        return _quiet_end()
    except PiprosError as error:
        _flush()
        print(f"ERROR: {_headline(error)}", file=sys.stderr)
        return error_code
    return code


def _headline(error: PiprosError) -> str:
    """The error as scripts know it; people at a terminal are also told what to try."""
    if isinstance(error, Unreachable) and error.peer.startswith("master "):
        error = MasterUnreachable(str(error))
    if isinstance(error, MasterUnreachable) and error.reason and sys.stderr.isatty():
        return f"{error}\n       {error.reason}."
    return str(error)


def _quiet_end() -> int:
    _flush()
    return 0


def _flush() -> None:
    """Writes what is buffered; when nobody reads any more, keeps the interpreter from complaining at exit."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        discard_output()
