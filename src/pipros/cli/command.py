"""The common part of all commands: options as ROS prints them, one line per error, no traceback at the end.

Most of the time of a command is interpreter start-up, so this module imports nothing that only some
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
    """A parser with usage texts as in Noetic: `Usage: rostopic list [/namespace]`. Errors exit with 2."""
    return OptionParser(usage=f"usage: {command} {usage}", prog=command, description=description)


def single_argument(parser: OptionParser, arguments: Sequence[str], *, missing: str, several: str) -> str:
    """The one argument of a command line; without it, or with more, exits with the text given for that."""
    if not arguments:
        parser.error(missing)
    if len(arguments) > 1:
        parser.error(several)
    return arguments[0]


def dispatch(subcommands: Mapping[str, str], argv: Sequence[str], overview: str, code: int) -> int:
    """Runs the subcommand that the first argument names; prints the overview when it names none.

    The subcommands are `module:function`, so that only the chosen one is imported.
    """
    if not argv or argv[0] not in subcommands:
        print(overview)
        return code
    module, _, function = subcommands[argv[0]].partition(":")
    subcommand: Subcommand = getattr(import_module(module), function)
    return subcommand(argv[1:])


def run(body: Callable[[], int], *, error_code: int = 1) -> int:
    """Runs a command and returns its exit code.

    An error is printed on standard error and returns `error_code`. Ctrl-C returns 0 without a
    traceback, as Noetic's commands do, and so does a pipe whose reader closed it (`| head`).
    """
    try:
        code = body()
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _end_quietly()
    except BrokenPipeError:
        return _end_quietly()
    except PiprosError as error:
        _flush()
        print(f"ERROR: {_headline(error)}", file=sys.stderr)
        return error_code
    return code


def _headline(error: PiprosError) -> str:
    """The error as scripts know it; on a terminal followed by what to try."""
    if isinstance(error, Unreachable) and error.peer.startswith("master "):
        error = MasterUnreachable(str(error))
    if isinstance(error, MasterUnreachable) and error.reason and sys.stderr.isatty():
        return f"{error}\n       {error.reason}."
    return str(error)


def _end_quietly() -> int:
    _flush()
    return 0


def _flush() -> None:
    """Writes buffered output; drops it if the reader is gone, so that Python reports nothing at exit."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        discard_output()
