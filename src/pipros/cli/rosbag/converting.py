"""`rosbag convert`: converts between ROS 1 bags, MCAP files and ROS 2 bags."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from optparse import Values
from pathlib import Path

from pipros.bag.compression import BZ2
from pipros.bag.errors import BagError
from pipros.bag.opening import writer_for
from pipros.bag.reader import BagReader
from pipros.bag.rewrite import copy_chosen, replaced_file
from pipros.bag.writer import MessageSink
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.limits import process_limits
from pipros.cli.rosbag.progress import Progress
from pipros.cli.rosbag.ros2_bags import add_folders_option, definition_folders, opened, warn
from pipros.cli.runner import add_flag, option_parser

_USAGE = """rosbag convert [options] IN OUT
       rosbag convert [options] --output-dir=DIR IN1 [IN2 ...]"""


def convert(argv: Sequence[str]) -> int:
    parser = option_parser("rosbag", "", "Convert between bag files, MCAP files and ROS 2 bags.")
    parser.usage = _USAGE
    parser.add_option("--output-dir", dest="output_dir", metavar="DIR", help="write to directory DIR")
    add_flag(parser, "-f", "--force", help="overwrite existing files")
    add_flag(parser, "-q", "--quiet", help="show no progress")
    parser.add_option(
        "--compression",
        dest="compression",
        default="",
        help="none, lz4, bz2 (bags), zstd (MCAP; its default)",
    )
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
    add_folders_option(parser)
    options, names = parser.parse_args(list(argv))
    if options.output_dir:
        folder = Path(options.output_dir)
        rename = _without_suffix if options.ros2 else _renamed
        pairs = [(Path(name), folder / rename(Path(name)).name) for name in names]
    elif len(names) == 2:
        pairs = [(Path(names[0]), Path(names[1]))]
    else:
        parser.error("You must specify an input and an output file, or --output-dir and input files.")
    if not pairs:
        parser.error("You must specify at least one input file.")
    if not options.ros2 and (options.storage or options.rules):
        parser.error("--storage and --rules need --ros2.")
    status = 0
    for source, target in pairs:
        try:
            if options.ros2:
                _convert_to_ros2(source, target, options)
            else:
                _convert(source, target, options)
        except (OSError, PiprosError) as error:
            print(f"ERROR converting {source}: {error}", file=sys.stderr)
            status = 1
    return status


def _renamed(path: Path) -> Path:
    return path.with_suffix(".bag" if path.suffix == ".mcap" else ".mcap")


def _without_suffix(path: Path) -> Path:
    return path.with_suffix("")


def _convert(source: Path, target: Path, options: Values) -> None:
    _check_target(source, target, force=options.force)
    compression = _for_mcap(options.compression, target) if target.suffix == ".mcap" else options.compression
    with opened(source, options.msgs) as bag, replaced_file(target) as file:
        writer = writer_for(target, file, compression=compression or "none")
        _copy(bag, writer, source, is_quiet=options.quiet)


def _for_mcap(compression: str, target: Path) -> str:
    """Return the compression of an MCAP file, which is zstd by default."""
    if compression != BZ2:
        return compression or "zstd"
    print(f"WARNING: MCAP does not support {BZ2}; {target} is compressed with zstd", file=sys.stderr)
    return "zstd"


def _convert_to_ros2(source: Path, target: Path, options: Values) -> None:
    """Write a ROS 2 bag.

    Raises:
        PiprosError: an option has an invalid value, or the bag cannot be read or written.
    """
    from pipros.ros2.bags.writer import new_ros2_bag
    from pipros.ros2.conversion.mapping import merged, parse_rules
    from pipros.ros2.distribution import Distribution

    distribution = next((each for each in Distribution if each.value == options.ros2), None)
    if distribution is None:
        known = ", ".join(each.value for each in Distribution)
        raise BagError(f"the ROS 2 distribution must be one of {known}, got [{options.ros2}]")
    if target.exists():
        raise BagError(f"{target} already exists")
    rules = merged([parse_rules(_read(name), name) for name in options.rules])
    storage = options.storage or ("sqlite3" if distribution is Distribution.HUMBLE else "mcap")
    folders = definition_folders(options.msgs)
    compression = (
        _for_mcap(options.compression, target) if storage == "mcap" else options.compression or "zstd"
    )
    with opened(source, options.msgs) as bag:
        with new_ros2_bag(
            target, distribution, storage=storage, compression=compression, folders=folders, rules=rules
        ) as writer:
            _copy(bag, writer, source, is_quiet=options.quiet)
        warn(writer.skipped, writer.incomplete)


def _copy(bag: BagReader, writer: MessageSink, source: Path, *, is_quiet: bool) -> None:
    total = sum(bag.chunk_header(number).size for number in range(len(bag.chunks)))
    progress = Progress(str(source), total, is_quiet=is_quiet or not total)
    copy_chosen(bag, writer, None, progress)
    progress.finish()


def _check_target(source: Path, target: Path, *, force: bool) -> None:
    if target.exists() and (not force or source.samefile(target)):
        raise BagError(f"{target} already exists" + ("" if force else "; --force overwrites it"))


def _read(name: str) -> str:
    try:
        return read_text(name, process_limits().file_bytes)
    except UnicodeDecodeError as error:
        raise BagError(f"{name}: {error}") from None
