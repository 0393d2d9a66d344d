"""`rosbag convert`: converts between bags, MCAP files, rerun recordings and formats that plugins add."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from optparse import Values
from pathlib import Path
from typing import Any

from pipros.basics.errors import MissingExtra, PiprosError
from pipros.basics.replaced_file import overwritten_file
from pipros_tools.bag.compression import BZ2
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.left_out import LeftOut
from pipros_tools.bag.opening import writer_for
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.rerun_file import rerun_file
from pipros_tools.bag.rewrite import copy_chosen
from pipros_tools.bag.sinks import MessageSink
from pipros_tools.cli.rosbag.converting_many import convert_all
from pipros_tools.cli.rosbag.other_bags import keep_beside, opened, other_bags, warned
from pipros_tools.cli.rosbag.progress import Progress
from pipros_tools.cli.runner import add_flag, option_parser

_USAGE = """rosbag convert [options] IN OUT
       rosbag convert [options] --output-dir=DIR IN1 [IN2 ...]"""


def convert(argv: Sequence[str]) -> int:
    parser = option_parser("rosbag", "", "Convert between bag files, MCAP files and other formats.")
    parser.epilog = "Writing OUT.rrd needs the rerun library: pip install rerun-sdk"
    parser.usage = _USAGE
    parser.add_option("--output-dir", dest="output_dir", metavar="DIR", help="write to directory DIR")
    parser.add_option(
        "-j",
        "--jobs",
        type="int",
        default=os.cpu_count() or 1,
        metavar="N",
        help="with --output-dir: number of processes (default: one for each processor)",
    )
    add_flag(parser, "-f", "--force", help="overwrite existing files")
    add_flag(parser, "-q", "--quiet", help="show no progress")
    parser.add_option(
        "--compression",
        dest="compression",
        default="",
        help="none (default for bags), lz4, bz2 (bags only) or zstd (MCAP only, and its default)",
    )
    others = other_bags()
    if others is not None:
        others.add_reading_options(parser)
        others.add_writing_options(parser)
    options, names = parser.parse_args(list(argv))
    if others is not None and not others.is_chosen(parser, options):
        others = None
    if options.output_dir:
        folder = Path(options.output_dir)
        folder.mkdir(parents=True, exist_ok=True)
        target_name = _target_name if others is None else others.target_name
        pairs = [(Path(name), folder / target_name(Path(name))) for name in dict.fromkeys(names)]
    elif len(names) == 2:
        pairs = [(Path(names[0]), Path(names[1]))]
    else:
        parser.error("You must specify an input and an output file, or --output-dir and input files.")
    if options.jobs < 1:
        parser.error(f"--jobs must be >= 1, got {options.jobs}")
    if not pairs:
        parser.error("You must specify at least one input file.")
    work = _convert if others is None else _convert_to_other
    if options.output_dir:
        return convert_all(pairs, options, work)
    (source, target), left_out = pairs[0], warned()
    try:
        work(source, target, options, left_out, partial(_progress, source, options))
    except (OSError, MissingExtra, PiprosError) as error:
        print(f"ERROR converting {source}: {error}", file=sys.stderr)
        return 1
    return 1 if left_out else 0


def _progress(source: Path, options: Values, total: int) -> Progress:
    return Progress(str(source), total, is_quiet=options.quiet)


def _target_name(source: Path) -> str:
    return f"{source.stem}{'.bag' if source.suffix == '.mcap' else '.mcap'}"


def _convert(
    source: Path, target: Path, options: Values, left_out: LeftOut, progress: Callable[[int], Any]
) -> None:
    _check_target(source, target, force=options.force)
    compression = options.compression
    if target.suffix == ".mcap":
        compression = compression_of(compression, target)
    if target.suffix == ".rrd":
        with opened(source, options, left_out) as bag, rerun_file(target, bag) as sink:
            _copy(bag, sink, progress)
        return
    with opened(source, options, left_out) as bag, overwritten_file(target) as file:
        writer = writer_for(target, file, compression=compression or "none")
        _copy(bag, writer, progress)


def compression_of(compression: str, target: Path) -> str:
    """Return the compression for an MCAP file, by default zstd. Print a warning if bz2 was requested."""
    if compression != BZ2:
        return compression or "zstd"
    print(f"WARNING: MCAP does not support {BZ2}; {target} is compressed with zstd", file=sys.stderr)
    return "zstd"


def _convert_to_other(
    source: Path, target: Path, options: Values, left_out: LeftOut, progress: Callable[[int], Any]
) -> None:
    others = other_bags()
    if others is None:
        raise BagError("this installation cannot write other formats")
    if target.exists() and (source.samefile(target) or target.resolve() in source.resolve().parents):
        raise BagError(f"{target} is the input")
    with opened(source, options, left_out) as bag, others.written(target, options, left_out) as writer:
        _copy(bag, writer, progress)


def _copy(bag: BagReader, writer: MessageSink, progress: Callable[[int], Any]) -> None:
    shown = progress(sum(bag.chunk_header(number).size for number in range(len(bag.chunks))) or bag.size)
    with keep_beside(bag, writer):
        copy_chosen(bag, writer, None, shown)
    shown.finish()


def _check_target(source: Path, target: Path, *, force: bool) -> None:
    if target.exists():
        if source.samefile(target):
            raise BagError(f"{target} is the input")
        if not force:
            raise BagError(f"{target} already exists; --force overwrites it")
