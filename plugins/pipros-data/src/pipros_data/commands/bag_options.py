"""Options and progress output that `rosbag query` and `rosbag table` share."""

from __future__ import annotations

import glob
import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from optparse import OptionParser, Values
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import MissingExtra, PiprosError
from pipros.msg.time import NS_PER_S
from pipros_tools.bag.errors import BagError
from pipros_tools.cli.rosbag.other_bags import add_reading_options, opened
from pipros_tools.cli.rosbag.progress import Progress
from pipros_tools.cli.runner import CommandError

if TYPE_CHECKING:
    from pipros_data.bags import Bags
    from pipros_data.table import Table
    from pipros_tools.bag.left_out import LeftOut
    from pipros_tools.bag.reader import BagReader


def add_row_options(parser: OptionParser) -> None:
    """Add the options that select rows, and the options for reading bags."""
    parser.add_option("--start", type="float", metavar="SEC", help="skip messages received before this time")
    parser.add_option("--end", type="float", metavar="SEC", help="skip messages received after this time")
    parser.add_option(
        "--every", type="int", default=1, metavar="N", help="take every N-th message of a topic"
    )
    parser.add_option(
        "--datetimes", default=False, action="store_true", help="write times as dates instead of ns"
    )
    parser.add_option("-q", "--quiet", default=False, action="store_true", help="show no progress")
    add_reading_options(parser)


def row_options(options: Values) -> dict[str, Any]:
    """Return the row options as arguments for `Bags.table`. Raise `CommandError` if `--every` is below 1."""
    if options.every < 1:
        raise CommandError(f"--every must be >= 1, got {options.every}")
    names = ("start", "end", "every", "datetimes")
    return {name: getattr(options, name) for name in names}


def opened_bags(
    names: Sequence[str], options: Values, left_out: LeftOut, is_requested: Callable[[str], bool]
) -> Bags:
    """Open bags. A file that cannot be read is left out if there are others.

    Raises:
        CommandError: a file does not exist, or the selected period lies outside those of the bags.
        BagError, OSError: no file can be read.
    """
    from pipros_data import Bags
    from pipros_data.opening import matching_files

    readers: list[BagReader] = []
    failed: dict[str, BagError | OSError] = {}
    try:
        for path in [path for name in names for path in matching_files(name)]:
            try:
                readers.append(opened(path, options, left_out, is_requested))
            except FileNotFoundError:
                raise
            except (BagError, OSError) as error:
                failed[path] = error
    except FileNotFoundError as error:
        raise CommandError(f"no such bag: {error.filename}") from None
    bags = Bags(readers)
    bags.on_bad_message = left_out.message
    for path, reason in failed.items():
        if not readers:
            raise reason
        left_out.whole(path, reason)
    ends = [time / NS_PER_S for bag in bags.readers if bag.message_count for time in bag.range_ns]
    start, end = options.start or 0, math.inf if options.end is None else options.end
    if ends and (start > max(ends) or end < min(ends)):
        bags.close()
        known = f"{min(ends):.2f} to {max(ends):.2f}, in seconds since 1970"
        raise CommandError(f"no message was received from {start} to {end}: the bags cover {known}")
    return bags


def format_of(path: Path) -> str:
    """Return the format for an output file's suffix. Raise `CommandError` if it is unknown."""
    from pipros_data.files import FORMATS

    kind = path.suffix.removeprefix(".")
    if kind not in FORMATS:
        suffixes = ", ".join(f".{each}" for each in FORMATS)
        raise CommandError(f"the output must end in one of {suffixes}, got [{path}]")
    return kind


def shown_batches(bags: Bags, topic: str, options: Values, rows: dict[str, Any]) -> Iterator[Table]:
    """Yield the batches of a topic, with a progress bar on a terminal."""
    count = max(bags.count(topic), 1)
    size = sum(bag.size for bag in bags.readers)
    bar = Progress(topic, size, is_quiet=options.quiet)

    def shown(done: int) -> None:
        bar(min(size, size * done * rows["every"] // count))

    yield from bags.batches(topic, progress=shown, **rows)
    bar.finish()


def bags_and_topics(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Divide arguments into bags, which exist, and topics, whatever they look like.

    If no bag exists, arguments that look like bags are returned as such.
    """
    bags = [each for each in arguments if _is_bag(each)]
    bags = bags or [each for each in arguments if _has_suffix(each) or not each.startswith("/")]
    return bags, [each for each in arguments if each not in bags]


def check_topics(bags: Bags, patterns: Sequence[str]) -> None:
    """Raise `CommandError` if a topic is unknown and looks like a bag."""
    for each in patterns:
        if _has_suffix(each) and not bags.topics(each):
            raise CommandError(f"no such bag: {each}")


def _is_bag(name: str) -> bool:
    if os.path.isdir(name):
        return any(_has_suffix(each) or each == "metadata.yaml" for each in os.listdir(name))
    if os.path.exists(name):
        return True
    if not glob.has_magic(name) or (name.startswith("/") and not _has_suffix(name)):
        return False
    return bool(glob.glob(name, recursive=True))


def _has_suffix(name: str) -> bool:
    return name.endswith((".bag", ".mcap", ".db3"))


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Convert errors about arguments and missing libraries to `CommandError`s. Exit with 130 after Ctrl-C."""
    try:
        yield
    except PiprosError:
        raise
    except KeyboardInterrupt:  # so that `&& rm run.bag` does not run; other `rosbag` commands exit with 0
        raise SystemExit(130) from None
    except (MissingExtra, ValueError) as error:
        raise CommandError(str(error)) from None
