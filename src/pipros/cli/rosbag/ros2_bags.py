"""Shared parts of the `rosbag` subcommands that can read or write ROS 2 bags."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from optparse import OptionParser
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.bag.opening import is_mcap, open_bag
from pipros.basics.printable import listed

if TYPE_CHECKING:
    from pipros.bag.reader import BagReader


def add_folders_option(parser: OptionParser) -> None:
    """Add the option `--msgs`, which names folders with ROS 2 definitions."""
    parser.add_option(
        "--msgs",
        dest="msgs",
        default=[],
        action="append",
        metavar="DIR",
        help="find ROS 2 message definitions in DIR, which contains packages",
    )


def definition_folders(given: Sequence[str]) -> list[Path]:
    """Return the folders given with `--msgs`, and the folders named by ROS 2's environment variables."""
    from pipros.ros2.interfaces.catalog import folders_of_environment

    return [*map(Path, given), *folders_of_environment(os.environ)]


def opened(path: str | os.PathLike[str], msgs: Sequence[str]) -> BagReader:
    """Open a ROS 1 or ROS 2 bag. Print a warning for each topic that cannot be converted.

    Raises:
        BagError, OSError: see `open_any_bag`.
    """
    if not os.path.isdir(path) and not is_mcap(path) and _is_ros1(path):
        return open_bag(path)
    # imported only here, because ROS 1 bags do not need it
    from pipros.ros2.bags.reader import Ros2BagReader, open_any_bag

    bag = open_any_bag(path, folders=definition_folders(msgs))
    if isinstance(bag, Ros2BagReader):
        warn(bag.skipped)
    return bag


def warn(skipped: Mapping[str, str], incomplete: Mapping[str, str] | None = None) -> None:
    """Print why topics, or some of their messages, are left out."""
    for topic, reason in skipped.items():
        print(f"WARNING: {listed(topic)} is left out: {listed(reason)}", file=sys.stderr)
    for topic, reason in (incomplete or {}).items():
        print(f"WARNING: messages on {listed(topic)} are left out: {listed(reason)}", file=sys.stderr)


def _is_ros1(path: str | os.PathLike[str]) -> bool:
    with open(path, "rb") as file:
        return file.read(6) != b"SQLite"
