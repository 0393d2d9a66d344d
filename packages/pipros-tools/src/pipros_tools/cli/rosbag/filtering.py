"""`rosbag filter`: copies the messages that match an expression to a new bag."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from pipros.basics.printable import listed, printable_lines
from pipros.basics.replaced_file import overwritten_file
from pipros.msg.errors import MessageException
from pipros.msg.time import Time
from pipros.safe.expr_walk import ExpressionError
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.filter_expression import MessageExpression
from pipros_tools.bag.left_out import LeftOut
from pipros_tools.bag.opening import writer_for
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.rewrite import copy_chosen
from pipros_tools.bag.times import received_at
from pipros_tools.cli.rosbag.other_bags import add_reading_options, keep_beside, opened, warned
from pipros_tools.cli.rosbag.progress import Progress
from pipros_tools.cli.runner import CommandError, option_parser

_USAGE = """rosbag filter [options] INBAG OUTBAG EXPRESSION

EXPRESSION can be any Python-legal expression.

The following variables are available:
 * topic: name of topic
 * m: message
 * t: time of message (t.secs, t.nsecs)"""


def filter(argv: Sequence[str]) -> int:  # noqa: A001 # the name of the subcommand
    parser = option_parser("rosbag", "", "Filter the contents of the bag.")
    parser.usage = _USAGE
    parser.add_option(
        "-p",
        "--print",
        dest="verbose_pattern",
        metavar="PRINT-EXPRESSION",
        help="Python expression to print for verbose debugging. Uses same variables as filter-expression",
    )
    add_reading_options(parser)
    options, arguments = parser.parse_args(list(argv))
    if not arguments:
        parser.error("You must specify an in bag, an out bag, and an expression.")
    if len(arguments) < 3:
        missing = "an expression" if len(arguments) == 2 else "an out bag and an expression"
        parser.error(f"You must specify {missing}.")
    if len(arguments) > 3:
        parser.error("Too many arguments.")
    source, target, text = Path(arguments[0]), Path(arguments[1]), arguments[2]
    if not source.exists():
        print(f"Cannot locate input bag file [{source}]", file=sys.stderr)
        return 2
    if target.exists() and source.samefile(target):
        print(f"Cannot use same file as input and output [{source}]", file=sys.stderr)
        return 3
    try:
        wanted = MessageExpression(text)
        shown = None if options.verbose_pattern is None else MessageExpression(options.verbose_pattern)
        left_out = warned()
        with opened(source, options, left_out) as bag:
            stored = _indexed(bag, wanted) if shown is None and not wanted.needs_message else None
            _write(bag, target, _choice(wanted, shown, left_out), stored)
    except ExpressionError as error:
        raise CommandError(str(error)) from error
    return 1 if left_out else 0


def _choice(
    wanted: MessageExpression, shown: MessageExpression | None, left_out: LeftOut
) -> Callable[[Connection, Callable[[], Any], Time], bool]:
    needs_message = wanted.needs_message or (shown is not None and shown.needs_message)

    def choose(connection: Connection, decode: Callable[[], Any], time: Time) -> bool:
        try:
            message = decode() if needs_message else None
        except (BagError, MessageException) as error:
            left_out.message(connection.topic, f"{received_at(time.to_nsec())}: {error}")
            return False
        is_wanted = bool(wanted.value(connection.topic, message, time))
        if shown is not None:
            value = shown.value(connection.topic, message, time)
            text = listed(value) if isinstance(value, str) else printable_lines(str(value))
            print(f"{'MATCH' if is_wanted else 'NO MATCH'} {text}")
        return is_wanted

    return choose


def _indexed(bag: BagReader, wanted: MessageExpression) -> Iterator[StoredMessage]:
    """Return the messages that match an expression without `m`. Chunks without such messages are not read."""

    def is_wanted(connection: Connection, time_ns: int) -> bool:
        return bool(wanted.value(connection.topic, None, Time(0, time_ns)))

    if wanted.needs_time:
        return bag.stored_messages(where=is_wanted)
    return bag.stored_messages([each for each in bag.connections if is_wanted(each, 0)])


def _write(
    bag: BagReader,
    target: Path,
    choice: Callable[[Connection, Callable[[], Any], Time], bool],
    stored: Iterator[StoredMessage] | None,
) -> None:
    with overwritten_file(target) as file:
        progress = Progress(str(target), sum(bag.chunk_header(n).size for n in range(len(bag.chunks))))
        writer = writer_for(target, file)
        with keep_beside(bag, writer):
            copy_chosen(bag, writer, choice if stored is None else None, progress, stored_messages=stored)
        progress.finish()
