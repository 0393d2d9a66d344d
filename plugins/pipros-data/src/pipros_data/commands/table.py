"""`rosbag table`: writes topics as one table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from pipros_data.commands.bag_options import (
    add_row_options,
    bags_and_topics,
    check_topics,
    format_of,
    one_line_errors,
    opened_bags,
    row_options,
    shown_batches,
)
from pipros_tools.cli.rosbag.other_bags import name_beside, warned
from pipros_tools.cli.runner import CommandError, option_parser

_USAGE = """rosbag table [options] BAG... TOPIC... -o OUT

Writes the messages of a topic as a table, with a row for each message. The suffix of OUT names the format:
.parquet, .arrow or .csv. With several topics, each row of the first one also has the last message of each
other topic."""


def table(argv: Sequence[str]) -> int:
    parser = option_parser("rosbag", "", "Write topics as a table: Parquet, Arrow or CSV.")
    parser.usage = _USAGE
    parser.add_option("-o", "--output", dest="output", metavar="OUT", help="the file to write")
    parser.add_option(
        "--on",
        default="receipt",
        metavar="TIME",
        help="join topics on receipt (default) or header, the stamps of the messages",
    )
    parser.add_option(
        "--tolerance", type="float", metavar="SEC", help="join only messages that are this close in time"
    )
    parser.add_option(
        "--direction",
        default="backward",
        metavar="WHICH",
        help="join the last message before (backward, default), the first after (forward) or the nearest",
    )
    add_row_options(parser)
    options, arguments = parser.parse_args(list(argv))
    names, patterns = bags_and_topics(arguments)
    if not names or not patterns or not options.output:
        parser.error("You must specify bags, topics, and an output file with -o.")
    output, left_out = Path(options.output), warned()

    def is_requested(topic: str) -> bool:
        return any(fnmatchcase(topic, each) or fnmatchcase(topic, f"/{each}") for each in patterns)

    with one_line_errors(), opened_bags(names, options, left_out, is_requested) as bags:
        patterns = [
            f"/{each}" if bags.topics(f"/{each}") and not bags.topics(each) else each for each in patterns
        ]
        check_topics(bags, patterns)
        kind = format_of(output)
        rows = row_options(options)
        topics = [topic for pattern in patterns for topic in bags.topics(pattern) or [pattern]]
        if len(topics) == 1:
            tables: Any = shown_batches(bags, topics[0], options, rows)
        else:
            join = {name: getattr(options, name) for name in ("on", "tolerance", "direction")}
            tables = [bags.asof(topics[0], *topics[1:], **join, **rows)]
        from pipros_data.files import write_arrow

        if output.exists() and any(output.samefile(name) for name in names if Path(name).exists()):
            raise CommandError(f"the output must not be one of the bags, got [{output}]")
        for name in write_arrow((each.to_arrow() for each in tables), output, kind):
            print(f"{name} is left out, because CSV cannot store bytes", file=sys.stderr)
        name_beside(bags.readers)
    return 1 if left_out else 0
