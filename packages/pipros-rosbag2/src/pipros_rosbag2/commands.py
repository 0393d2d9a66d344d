"""ROS 2 bags for `rosbag`; see `pipros_tools.cli.rosbag.other_bags.OtherBags`."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from optparse import OptionParser
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from pipros_tools.bag.errors import BagError

if TYPE_CHECKING:
    from pipros_tools.bag.left_out import LeftOut
    from pipros_tools.bag.reader import BagReader
    from pipros_tools.bag.sinks import MessageSink


def add_reading_options(parser: OptionParser) -> None:
    """Add the option `--msgs` for folders with ROS 2 definitions."""
    parser.add_option(
        "--msgs",
        dest="msgs",
        default=[],
        action="append",
        metavar="DIR",
        help="find ROS 2 message definitions in DIR, which contains packages",
    )


def definition_folders(given: Sequence[str]) -> list[Path]:
    """Return the folders given with `--msgs`, and the `share` folders in `AMENT_PREFIX_PATH`."""
    from pipros_rosbag2.interfaces.installed import folders_of_environment

    return [*map(Path, filter(None, given)), *folders_of_environment(os.environ)]


def opened(path: str | os.PathLike[str], options: Any) -> BagReader:
    """Open a ROS 2 bag.

    Raises:
        BagError, OSError: see `open_any_bag`.
    """
    from pipros_rosbag2.bags.reader import open_any_bag

    return open_any_bag(path, folders=definition_folders(options.msgs))


def add_writing_options(parser: OptionParser) -> None:
    """Add the options for ROS 2 bags."""
    parser.add_option(
        "--ros2",
        dest="ros2",
        metavar="DISTRO",
        help="write a ROS 2 bag, a folder, for humble, jazzy, kilted or lyrical",
    )
    parser.add_option(
        "--storage",
        dest="storage",
        metavar="FORMAT",
        help="mcap or sqlite3, for --ros2 (default: sqlite3 for humble, otherwise mcap)",
    )
    parser.add_option(
        "--rules",
        dest="rules",
        default=[],
        action="append",
        metavar="FILE",
        help="use the mapping rules in FILE, in the format of ros1_bridge, for --ros2",
    )


def is_chosen(parser: OptionParser, options: Any) -> bool:
    """Return whether `--ros2` was given. Exit with an error if only options that require it were given."""
    if not options.ros2 and (options.storage or options.rules):
        parser.error("--storage and --rules need --ros2.")
    return bool(options.ros2)


def recover(path: Path, file: BinaryIO) -> list[str]:
    """Copy the readable records of an SQLite file to a new one. Return descriptions of the damage."""
    from pipros_rosbag2.bags.sqlite_repair import recover

    return recover(path, file)


def target_name(source: Path) -> str:
    """Return the name of the output folder for an input bag."""
    return source.stem


@contextlib.contextmanager
def written(target: Path, options: Any, left_out: LeftOut) -> Iterator[MessageSink]:
    """Create a ROS 2 bag. Report the topics and messages that are left out.

    Raises:
        PiprosError, OSError: an option has an invalid value, or the bag cannot be written.
    """
    from pipros_rosbag2.bags.writer import new_ros2_bag
    from pipros_rosbag2.conversion.mapping import merged, parse_rules
    from pipros_rosbag2.distribution import Distribution
    from pipros_tools.cli.rosbag.converting import compression_of

    distribution = next((each for each in Distribution if each.value == options.ros2), None)
    if distribution is None:
        known = ", ".join(each.value for each in Distribution)
        raise BagError(f"the ROS 2 distribution must be one of {known}, got [{options.ros2}]")
    rules = merged([parse_rules(_read(name), name) for name in options.rules])
    storage = options.storage or ("sqlite3" if distribution is Distribution.HUMBLE else "mcap")
    compression = compression_of(options.compression, target) if storage == "mcap" else options.compression
    with new_ros2_bag(
        target,
        distribution,
        storage=storage,
        compression=compression or "zstd",
        folders=definition_folders(options.msgs),
        rules=rules,
        replaces=options.force,
    ) as writer:
        yield writer
    for topic, reason in writer.skipped.items():
        left_out.whole(topic, reason, bag=str(target))
    for topic, reason in writer.incomplete.items():
        left_out.message(topic, reason, bag=str(target))


def _read(name: str) -> str:
    from pipros.basics.input_file import read_text
    from pipros.basics.limits import process_limits

    try:
        return read_text(name, process_limits().file_bytes)
    except UnicodeDecodeError as error:
        raise BagError(f"{name}: {error}") from None
