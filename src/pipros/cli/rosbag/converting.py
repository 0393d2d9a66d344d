"""`rosbag convert`: converts between bags and MCAP."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from pipros.bag.errors import BagError
from pipros.bag.opening import open_bag, writer_for
from pipros.bag.rewrite import copy_chosen, replaced_file
from pipros.cli.rosbag.progress import Progress
from pipros.cli.runner import add_flag, option_parser

_USAGE = """rosbag convert [options] IN OUT
       rosbag convert [options] --output-dir=DIR IN1 [IN2 ...]"""


def convert(argv: Sequence[str]) -> int:
    parser = option_parser("rosbag", "", "Convert bag files to MCAP, and MCAP files to bags.")
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
    options, names = parser.parse_args(list(argv))
    if options.output_dir:
        folder = Path(options.output_dir)
        pairs = [(Path(name), folder / _renamed(Path(name)).name) for name in names]
    elif len(names) == 2:
        pairs = [(Path(names[0]), Path(names[1]))]
    else:
        parser.error("You must specify an input and an output file, or --output-dir and input files.")
    if not pairs:
        parser.error("You must specify at least one input file.")
    status = 0
    for source, target in pairs:
        try:
            _convert(source, target, options.compression, options.force, is_quiet=options.quiet)
        except (OSError, BagError) as error:
            print(f"ERROR converting {source}: {error}", file=sys.stderr)
            status = 1
    return status


def _renamed(path: Path) -> Path:
    return path.with_suffix(".bag" if path.suffix == ".mcap" else ".mcap")


def _convert(source: Path, target: Path, compression: str, force: bool, *, is_quiet: bool) -> None:
    if target.exists() and (not force or source.samefile(target)):
        raise BagError(f"{target} already exists" + ("" if force else "; --force overwrites it"))
    default = "zstd" if target.suffix == ".mcap" else "none"
    with open_bag(source) as bag, replaced_file(target) as file:
        total = sum(bag.chunk_header(number).size for number in range(len(bag.chunks)))
        progress = Progress(str(source), total, is_quiet=is_quiet)
        copy_chosen(bag, writer_for(target, file, compression=compression or default), None, progress)
        progress.finish()
