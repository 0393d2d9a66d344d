"""`rosbag merge` and `rosbag split`."""

from __future__ import annotations

import os
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from optparse import OptionParser, Values
from pathlib import Path

from pipros.basics.replaced_file import overwritten_file
from pipros.msg.time import NS_PER_S
from pipros_tools.bag.opening import writer_for
from pipros_tools.bag.parts import merge as merge_bags
from pipros_tools.bag.parts import split as split_bag
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.sinks import MessageWriter
from pipros_tools.cli.rosbag.converting import compression_of
from pipros_tools.cli.rosbag.other_bags import add_reading_options, keep_beside, opened, warned
from pipros_tools.cli.rosbag.progress import Progress
from pipros_tools.cli.rosbag.quantities import bytes_of, seconds_of
from pipros_tools.cli.runner import CommandError, add_flag, option_parser


def merge(argv: Sequence[str]) -> int:
    parser = _parser("Merge several bag files into one.", "rosbag merge [options] BAG1 [BAG2 ...] -o OUT")
    parser.add_option("-o", "--output", metavar="OUT", help="the file to write, a .bag or .mcap file")
    options, names = parser.parse_args(list(argv))
    if not names or not options.output:
        parser.error("You must specify bag files, and an output file with -o.")
    target, left_out = Path(options.output), warned()
    _check_free([target], names, options)
    with ExitStack() as stack:
        bags = [stack.enter_context(opened(name, options, left_out)) for name in names]
        progress = _progress(str(target), bags, options)
        with _written(target, options) as writer, ExitStack() as copies:
            for bag in bags:
                copies.enter_context(keep_beside(bag, writer))
            merge_bags(bags, writer, progress)
    progress.finish()
    return 1 if left_out else 0


def split(argv: Sequence[str]) -> int:
    parser = _parser(
        "Split a bag file by time or size.",
        "rosbag split [options] BAG (--every DURATION | --size SIZE | --at TIME [--at TIME ...])",
    )
    add = parser.add_option
    add("--every", metavar="DURATION", help="begin a bag after each DURATION, such as 60s, 5m or 2h")
    add(
        "--size",
        metavar="SIZE",
        help="begin a bag when the last one has SIZE MB, or a size such as 500k or 2G",
    )
    at = "begin a bag at TIME, in seconds since 1970, or, with a plus sign, after the first message: +90s"
    add("--at", action="append", default=[], metavar="TIME", help=at)
    add("--output-dir", metavar="DIR", help="write to directory DIR")
    add_flag(parser, "--repeat-latched", help="repeat latched messages at the start of each bag")
    options, names = parser.parse_args(list(argv))
    if len(names) != 1:
        parser.error("You must specify one bag file.")
    if sum(map(bool, (options.every, options.size, options.at))) != 1:
        parser.error("You must specify one of --every, --size and --at.")
    source, left_out = Path(names[0]), warned()
    folder = Path(options.output_dir) if options.output_dir else source.parent
    suffix = source.suffix if source.suffix in (".bag", ".mcap") else ".bag"
    pattern = f"{source.stem}_[0-9]*{suffix}"
    _check_free(sorted(each for each in folder.glob(pattern) if _is_part(each, source)), names, options)
    try:
        size_bytes = _size_bytes(options.size) if options.size else 0
        with opened(source, options, left_out) as bag:
            part_of = _part_of(bag, options)
            folder.mkdir(parents=True, exist_ok=True)
            progress = _progress(str(source), [bag], options)
            with ExitStack() as copies:

                @contextmanager
                def part(number: int) -> Iterator[MessageWriter]:
                    with _written(folder / f"{source.stem}_{number}{suffix}", options) as writer:
                        if not number:  # what stands beside messages is in the first part
                            copies.enter_context(keep_beside(bag, writer))
                        yield writer

                size = {"size_bytes": size_bytes, "repeats_latched": options.repeat_latched}
                count = split_bag(bag, part, part_of, progress, **size)
    except ValueError as error:
        raise CommandError(str(error)) from None
    progress.finish()
    if not options.quiet:
        names_text = f"{folder / source.stem}_0{suffix} to _{count - 1}{suffix}" if count else "no messages"
        print(f"{count} bags: {names_text}")
    return 1 if left_out else 0


def _parser(description: str, usage: str) -> OptionParser:
    parser = option_parser("rosbag", "", description)
    parser.usage = usage
    add_flag(parser, "-f", "--force", help="overwrite existing files")
    add_flag(parser, "-q", "--quiet", help="show no progress")
    parser.add_option("--compression", default="", help="as for rosbag convert")
    add_reading_options(parser)
    return parser


def _size_bytes(text: str) -> int:
    """Return a size in bytes. A number alone is in MB, as for `rosbag record`."""
    found = bytes_of(f"{text}M" if text.isdecimal() else text, "--size")
    if not found:
        raise ValueError(f"--size must be > 0, got {text}")
    return found


def _is_part(path: Path, source: Path) -> bool:
    return path.stem.removeprefix(f"{source.stem}_").isdecimal()


def _check_free(targets: Sequence[Path], names: Sequence[str], options: Values) -> None:
    """Raise `CommandError` if an output exists and must not be replaced."""
    for target in filter(Path.exists, targets):
        if any(os.path.exists(name) and target.samefile(name) for name in names):
            raise CommandError(f"{target} is an input")
        if not options.force:
            raise CommandError(f"{target} already exists; --force overwrites it")


def _progress(label: str, bags: Sequence[BagReader], options: Values) -> Progress:
    total = sum(bag.chunk_header(number).size for bag in bags for number in range(len(bag.chunks)))
    return Progress(label, total, is_quiet=options.quiet or not total)


@contextmanager
def _written(target: Path, options: Values) -> Iterator[MessageWriter]:
    """Context manager for a new bag, which appears when it is complete."""
    compression = options.compression
    if target.suffix == ".mcap":
        compression = compression_of(compression, target)
    with overwritten_file(target) as file:
        yield writer_for(target, file, compression=compression or "none")


def _part_of(bag: BagReader, options: Values) -> Callable[[int], int]:
    """Return a function that returns the number of the part for a time in ns."""
    first_ns = bag.range_ns[0] if bag.message_count else 0
    if options.every:
        step_ns = round(seconds_of(options.every) * NS_PER_S)
        return lambda time_ns: (time_ns - first_ns) // step_ns
    times = sorted(_time_ns(text, first_ns) for text in options.at)
    return lambda time_ns: bisect_right(times, time_ns)


def _time_ns(text: str, first_ns: int) -> int:
    if text.startswith("+"):
        return first_ns + round(seconds_of(text[1:]) * NS_PER_S)
    whole, _, part = text.partition(".")
    if not whole.isdecimal() or not (part or "0").isdecimal():
        raise ValueError(f"--at must be like 1700000000.5 or +90s, got {text}")
    return int(whole) * NS_PER_S + int(part[:9].ljust(9, "0"))
