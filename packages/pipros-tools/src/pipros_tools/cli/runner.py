"""Shared behaviour of most commands: ROS-style options, one line per error, no tracebacks.

Most of a command's run time is interpreter start-up, so this module imports nothing that only some commands
need.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import PiprosError, Unreachable
from pipros.basics.printable import printable_lines
from pipros_tools.cli.entry_point import discard_output
from pipros_tools.graph.errors import NO_MASTER

if TYPE_CHECKING:
    from optparse import OptionParser

USAGE_ERROR = 64
"""EX_USAGE from sysexits.h, which most ROS commands return if the subcommand is missing or unknown."""

Subcommand = Callable[[Sequence[str]], int]


class CommandError(PiprosError):
    """The command cannot perform the request. The text is printed after `ERROR: `."""


class MasterUnreachable(CommandError):
    """No master answers at ROS_MASTER_URI."""

    def __init__(self, reason: str = "") -> None:
        self.reason = reason
        super().__init__(NO_MASTER)


def option_parser(command: str, usage: str, description: str | None = None) -> OptionParser:
    """Return a parser whose usage text has Noetic's format: `Usage: rostopic list [/namespace]`.

    If a command line is invalid, the parser exits with code 2. Arguments that roslaunch appends are ignored.
    """
    # _DeferredParser passes other attributes on to an OptionParser
    return _DeferredParser(command, f"usage: {command} {usage}", description)  # type: ignore[return-value]


class _DeferredParser:
    """Substitute for an `OptionParser`, which is only created if a command line has an option or an error.

    Importing optparse takes longer than a call to the master, and most command lines have no options.
    """

    _WITHOUT_VALUE = ("callback", "help", "version")

    def __init__(self, command: str, usage: str, description: str | None) -> None:
        self.usage = usage
        self._command = command
        self._description = description
        self._options: list[tuple[tuple[str, ...], dict[str, Any]]] = []
        self._complete: OptionParser | None = None

    def add_option(self, *names: str, **settings: Any) -> None:
        self._options.append((names, settings))
        if self._complete is not None:
            self._complete.add_option(*names, **settings)

    def parse_args(self, arguments: list[str]) -> tuple[Any, list[str]]:
        from pipros.basics.names import without_launch_arguments

        arguments = without_launch_arguments(arguments)
        if self._complete is not None or any(argument.startswith("-") for argument in arguments):
            return self._parser().parse_args(arguments)
        return SimpleNamespace(**self._defaults()), arguments

    def __getattr__(self, name: str) -> Any:
        return getattr(self._parser(), name)

    def _parser(self) -> OptionParser:
        if self._complete is None:
            from optparse import OptionParser

            self._complete = OptionParser(self.usage, prog=self._command, description=self._description)
            for names, settings in self._options:
                self._complete.add_option(*names, **settings)
        return self._complete

    def _defaults(self) -> dict[str, Any]:
        defaults: dict[str, Any] = {}
        for names, settings in self._options:
            name = settings.get("dest")
            if name is None and settings.get("action") not in self._WITHOUT_VALUE:
                first = next((name for name in names if name.startswith("--")), names[0])
                name = first.lstrip("-").replace("-", "_")
            if name is not None and ("default" in settings or name not in defaults):
                defaults[name] = settings.get("default")
        return defaults


def add_flag(parser: OptionParser, *names: str, help: str, dest: str | None = None) -> None:  # noqa: A002
    """Add a boolean flag, False by default."""
    parser.add_option(*names, dest=dest, default=False, action="store_true", help=help)


def single_argument(parser: OptionParser, arguments: Sequence[str], *, missing: str, several: str) -> str:
    """Return the only argument. If there are none or several, exit with the error `missing` or `several`."""
    if not arguments:
        parser.error(missing)
    if len(arguments) > 1:
        parser.error(several)
    return arguments[0]


def only_argument(tool: str, usage: str, argv: Sequence[str], *, missing: str, several: str) -> str:
    """Return the only argument to a subcommand without options. For the errors, see `single_argument`.

    Remappings are ignored.
    """
    from pipros.basics.names import parse_arguments

    parser = option_parser(tool, usage)
    _, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    return single_argument(parser, arguments, missing=missing, several=several)


def dispatch(subcommands: Mapping[str, str], argv: Sequence[str], overview: str, code: int) -> int:
    """Run the subcommand named by the first argument.

    If the argument is missing or unknown, print `overview` and return `code`. `subcommands` maps names to
    `module:function`. Only the module of the chosen subcommand is imported.
    """
    if not argv or argv[0] not in subcommands:
        print(overview)
        return code
    module, _, function = subcommands[argv[0]].partition(":")
    subcommand: Subcommand = getattr(import_module(module), function)
    return subcommand(argv[1:])


def run(body: Callable[[], int], *, error_code: int = 1) -> int:
    """Run a command and return its exit code.

    If `body` raises `PiprosError`, print it to standard error and return `error_code`. After Ctrl-C, or
    if the reader of a pipe closes it (`| head`), return 0 without a traceback, like Noetic's commands.
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
        print(f"ERROR: {printable_lines(_headline(error))}", file=sys.stderr)
        return error_code
    return code


def _headline(error: PiprosError) -> str:
    """Return the error's text, which scripts may parse. On a terminal, add why the master is unreachable."""
    if isinstance(error, Unreachable) and error.peer.startswith("master "):
        error = MasterUnreachable(str(error))
    if isinstance(error, MasterUnreachable) and error.reason and sys.stderr.isatty():
        return f"{error}\n       {error.reason}."
    return str(error)


def _end_quietly() -> int:
    _flush()
    return 0


def _flush() -> None:
    """Write buffered output.

    If the reader has exited, drop the output, so that Python reports no error at exit.
    """
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        discard_output()
