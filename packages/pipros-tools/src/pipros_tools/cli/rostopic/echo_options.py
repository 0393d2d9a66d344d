"""The options of `rostopic echo`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from optparse import OptionParser

from pipros_tools.cli.runner import option_parser


@dataclass(frozen=True, slots=True, kw_only=True)
class EchoOptions:
    """The format of printed messages.

    Attributes:
        count: the number of messages to print; None for no limit.
        plot: whether to print rows of a table.
        no_arrays, no_texts: whether to omit arrays or strings from table rows, and to print only their size
            in other formats.
        width: the width of numbers, in characters.
        clear: whether to clear the screen before each message.
        offset: whether to print times as offsets from the current time.
        expression: a Python expression; only messages for which it is true are printed.
    """

    count: int | None = None
    plot: bool = False
    no_arrays: bool = False
    no_texts: bool = False
    width: int | None = None
    clear: bool = False
    offset: bool = False
    expression: str | None = None


@dataclass(frozen=True, slots=True)
class BagChoice:
    """The bag to echo from, and whether to print all its topics."""

    path: str
    shows_all: bool


def parse(argv: Sequence[str]) -> tuple[str, EchoOptions, BagChoice | None]:
    """Return the topic, the printing options and, if one is given, the bag.

    Exit with an error if `argv` is invalid.
    """
    parser = option_parser("rostopic", "echo [options] /topic")
    add = parser.add_option
    add("-b", "--bag", dest="bag", metavar="BAGFILE", help="echo messages from .bag file")
    add("-p", dest="plot", action="store_true", default=False, help="echo in a plotting friendly format")
    add("-w", dest="width", metavar="NUM_WIDTH", help="fixed width for numeric values")
    add(
        "--filter",
        dest="expression",
        metavar="FILTER-EXPRESSION",
        help="Python expression to filter messages that are printed. Expression can use Python builtins"
        " as well as m (the message) and topic (the topic name).",
    )
    add("--nostr", dest="no_texts", action="store_true", default=False, help="exclude string fields")
    add("--noarr", dest="no_arrays", action="store_true", default=False, help="exclude arrays")
    add(
        "-c",
        "--clear",
        dest="clear",
        action="store_true",
        default=False,
        help="clear screen before printing next message",
    )
    add(
        "-a",
        "--all",
        dest="all",
        action="store_true",
        help="display all message in bag, only valid with -b option",
    )
    add("-n", dest="count", metavar="COUNT", help="number of messages to echo")
    add(
        "--offset",
        dest="offset",
        action="store_true",
        default=False,
        help="display time as offsets from current time (in seconds)",
    )
    options, arguments = parser.parse_args(list(argv))
    if len(arguments) > 1:
        parser.error("you may only specify one input topic")
    if options.all and not options.bag:
        parser.error("Display all option is only valid when echoing from bag files")
    if not arguments and not options.all:
        parser.error("topic must be specified")
    if options.bag and options.offset:
        parser.error("offset time option is not valid with bag files")
    width = _integer(parser, options.width, "NUM_WIDTH")
    if width is not None and width < 2:
        parser.error("Fixed width for numeric values must be at least 2")
    count = _integer(parser, options.count, "COUNT")
    bag = BagChoice(options.bag, bool(options.all)) if options.bag else None
    shown = EchoOptions(
        count=count,
        plot=options.plot,
        no_arrays=options.no_arrays,
        no_texts=options.no_texts,
        width=width,
        clear=options.clear,
        offset=options.offset,
        expression=options.expression,
    )
    return arguments[0] if arguments else "/", shown, bag


def _integer(parser: OptionParser, text: str | None, name: str) -> int | None:
    try:
        return None if text is None else int(text)
    except ValueError:
        parser.error(f"{name} must be an integer")
