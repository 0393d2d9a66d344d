"""`rosbag query`: selects rows of topics with SQL."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from pipros_data.commands.bag_options import (
    add_row_options,
    format_of,
    one_line_errors,
    opened_bags,
    row_options,
    shown_batches,
)
from pipros_tools.cli.rosbag.other_bags import name_beside, warned
from pipros_tools.cli.runner import option_parser

if TYPE_CHECKING:
    from optparse import Values

    from pipros_data.bags import Bags

_USAGE = """rosbag query [options] BAG... 'SELECT ...'

Prints rows as CSV. A table has the name of its topic: "/imu/data", with double quotes, or imu_data. Columns
with dots need double quotes, too: "header.stamp"."""


def query(argv: Sequence[str]) -> int:
    parser = option_parser("rosbag", "", "Select rows of topics with SQL.")
    parser.usage = _USAGE
    parser.add_option(
        "-o", "--output", dest="output", metavar="OUT", help="write .parquet, .arrow or .csv instead"
    )
    add_row_options(parser)
    options, arguments = parser.parse_args(list(argv))
    if len(arguments) < 2:
        parser.error("You must specify a bag file and a query.")
    *names, sql = arguments
    not_read = warned()
    with (
        one_line_errors(),
        opened_bags(names, options, not_read, lambda topic: topic.lower() in sql.lower()) as bags,
        TemporaryDirectory(prefix="rosbag-query-") as folder,
    ):
        left_out = _query(bags, sql, folder, options)
        name_beside(bags.readers)
    for name in left_out:
        print(f"{name} is left out, because CSV cannot store bytes", file=sys.stderr)
    return 1 if not_read else 0


def _query(bags: Bags, sql: str, folder: str, options: Values) -> list[str]:
    from pipros_data.files import print_csv, write_arrow
    from pipros_data.sql import Database, queried

    rows = row_options(options)
    output = Path(options.output) if options.output else None
    kind = "csv" if output is None else format_of(output)
    with Database(folder, bags.topics()) as database:
        batches = queried(
            database, sql, bags.topics(), lambda topic: shown_batches(bags, topic, options, rows)
        )
        return print_csv(batches) if output is None else write_arrow(batches, output, kind)
