"""`rosconsole echo`: prints log messages as they arrive."""

from __future__ import annotations

import re
from argparse import ArgumentParser, ArgumentTypeError
from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from typing import Any

from pipros.basics.names import parse_arguments
from pipros.basics.printable import listed, printable_lines
from pipros_tools.cli.terminal import has_colours
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.loggers import LEVELS

# Level numbers from rosgraph_msgs/Log, and Noetic's colours.
_NUMBERS = {"DEBUG": 1, "INFO": 2, "WARN": 4, "ERROR": 8, "FATAL": 16}
_COLOURS = {"DEBUG": 92, "INFO": 97, "WARN": 93, "ERROR": 91, "FATAL": 95}
_NAMES = {number: name for name, number in _NUMBERS.items()}
_INDENT = " " * 10
_LOG_TYPES = ("rosgraph_msgs/Log", "roslib/Log")
"""Message types that `echo` accepts."""


def echo(argv: Sequence[str]) -> int:
    arguments = parse_arguments(argv)
    parser = ArgumentParser(prog="rosconsole echo", description="Print logger messages")
    parser.add_argument(
        "filter",
        metavar="FILTER",
        type=_pattern,
        nargs="?",
        default=_pattern(".*"),
        help="regular expression to filter the logger name (default: .*)",
    )
    parser.add_argument(
        "-l",
        "--level",
        choices=LEVELS,
        default="warn",
        metavar="LEVEL",
        help="minimum logger level to print (default: %(default)s)",
    )
    parser.add_argument("-1", "--once", action="store_true", help="prints one logger message and exits")
    parser.add_argument(
        "--topic",
        metavar="TOPIC",
        default="/rosout",
        help="topic to read the logger messages from (default: %(default)s)",
    )
    parser.add_argument("--nocolor", action="store_true", help="output without color")
    parser.add_argument("-v", "--verbose", action="store_true", help="print full logger details")
    options = parser.parse_args(arguments.rest)
    printer = LogPrinter(
        options.filter,
        _NUMBERS[options.level.upper()],
        is_coloured=not options.nocolor and has_colours(),
        is_verbose=options.verbose,
    )
    _follow(options.topic, printer, is_once=options.once, argv=argv)
    return 0


def _pattern(text: str) -> re.Pattern[str]:
    try:
        return re.compile(text)
    except re.error as error:
        raise ArgumentTypeError(f"[{text}] must be a regular expression: {error}") from None


def _follow(topic: str, printer: LogPrinter, *, is_once: bool, argv: Sequence[str]) -> None:
    from pipros.msg import load_message_class
    from pipros_tools.cli.command_node import command_node
    from pipros_tools.graph.listening import Listening
    from pipros_tools.graph.raw_decoder import decode_as

    with GraphClient("rosconsole") as graph:
        graph.master.get_pid()  # fail at once if there is no master
        name = graph.resolve(topic)
    log_class = load_message_class("rosgraph_msgs/Log")
    with command_node("rosconsole", argv) as node:
        listening = Listening(node)

        def show(message: Any) -> None:
            if message.header.get("type") not in _LOG_TYPES:
                raise GraphError(
                    f"topic [{name}] must be of type rosgraph_msgs/Log, got "
                    f"[{listed(message.header.get('type'))}]"
                )
            if printer.show(decode_as(message, name, log_class)) and is_once:
                listening.finish()

        listening.subscribe(name, show)
        listening.wait()


class LogPrinter:
    """Printer for rosgraph_msgs/Log messages that have at least a given level and pass a filter."""

    def __init__(
        self,
        pattern: re.Pattern[str],
        level: int,
        *,
        is_coloured: bool,
        is_verbose: bool,
        write: Callable[[str], object] | None = None,
    ) -> None:
        """Create a printer.

        `pattern` is a regular expression to search for in node names; `level` is a severity constant from
        rosgraph_msgs/Log.
        """
        self._pattern = pattern
        self._level = level
        self._is_coloured = is_coloured
        self._is_verbose = is_verbose
        self._write = write or _to_stdout

    def show(self, message: Any) -> bool:
        """Print a message unless it is filtered out; return whether the message was printed."""
        if message.level < self._level or not self._pattern.search(message.name):
            return False
        level = _NAMES.get(message.level, str(message.level))
        padded, name = f"{level:5}", listed(message.name)
        if self._is_coloured:
            padded = f"\x1b[{_COLOURS.get(level, 97)}m{padded}\x1b[0m"
            name = f"\x1b[1m{name}\x1b[22m"
        lines = [f"[ {padded} ] [{name}]: {printable_lines(message.msg)}"]
        if self._is_verbose:
            lines.append(f"{_INDENT}{_details(message)}")
        self._write("\n".join(lines))
        return True


def _details(message: Any) -> str:
    seconds = message.header.stamp.to_sec()
    try:
        when = str(datetime.fromtimestamp(seconds, timezone.utc).astimezone())
    except (OverflowError, OSError, ValueError):
        when = "-"
    place = f"{listed(message.function)}]: {listed(message.file)}:{message.line}"
    return f"[{when} ({seconds:.6f})] [{place}"


def _to_stdout(text: str) -> None:
    print(text, flush=True)
