"""`rosbag info`: summarizes bags."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Any

from pipros_tools.bag.errors import BagError, NotIndexed
from pipros_tools.bag.info import bag_info
from pipros_tools.bag.info_text import info_text, info_value, info_yaml
from pipros_tools.cli.entry_point import OutputFailed
from pipros_tools.cli.rosbag.other_bags import add_reading_options, opened, warned
from pipros_tools.cli.runner import add_flag, option_parser


def info(argv: Sequence[str]) -> int:
    parser = option_parser(
        "rosbag",
        "rosbag info [options] BAGFILE1 [BAGFILE2 BAGFILE3 ...]",
        "Summarize the contents of one or more bag files.",
    )
    parser.usage = "rosbag info [options] BAGFILE1 [BAGFILE2 BAGFILE3 ...]"
    add_flag(parser, "-y", "--yaml", help="print information in YAML format")
    parser.add_option("-k", "--key", dest="key", help="print information on the given key")
    add_flag(parser, "--freq", help="display topic message frequency statistics")
    add_reading_options(parser)
    options, paths = parser.parse_args(list(argv))
    if not paths:
        parser.error("You must specify at least 1 bag file.")
    if options.key and not options.yaml:
        parser.error("You can only specify key when printing in YAML format.")
    status = 0
    for number, path in enumerate(paths):
        if number:
            print("---")
        try:
            if not _print(path, options):
                status = 1
        except (OutputFailed, BrokenPipeError):
            raise
        except (OSError, BagError) as error:
            text = f"ERROR reading {path}: {error}"
            if isinstance(error, NotIndexed) and not os.path.isdir(path):
                text = f"ERROR bag unindexed: {path}.  Run rosbag reindex."
            print(text, file=sys.stderr)
            status = 1
    return status


def _print(path: str, options: Any) -> bool:
    """Print the facts. Return whether they are complete, which they are not if a file of the bag is left out.

    Topics that cannot be read are listed.
    """
    with opened(path, options, warned()) as bag:
        is_complete = not bag.skipped_files
        facts = bag_info(bag, path, with_frequencies=bool(options.freq))
    if not options.yaml:
        print(info_text(facts))
        return is_complete
    try:
        print(info_yaml(facts) if options.key is None else info_value(facts, options.key))
    except BagError as error:
        print(error, file=sys.stderr)
    return is_complete
