"""`rosbag compress`, `decompress` and `reindex`: rewrite bags.

Unless `--output-dir` is given, each rewritten bag replaces the original, which is kept as `NAME.orig.bag`.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Sequence
from optparse import OptionParser, Values
from pathlib import Path
from typing import Any

from pipros.basics.input_file import open_file, read_file
from pipros.basics.replaced_file import replaced_file
from pipros.basics.windows import replace_file
from pipros_tools.bag.compression import BZ2, LZ4, NONE
from pipros_tools.bag.errors import BagError, NotIndexed
from pipros_tools.bag.layout import read_version
from pipros_tools.bag.opening import check_no_pointer, is_mcap, is_ros1_bag
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.repair import reindex as reindex_file
from pipros_tools.bag.rewrite import recompress
from pipros_tools.bag.source import Source
from pipros_tools.cli.rosbag.other_bags import other_bags
from pipros_tools.cli.rosbag.progress import Progress
from pipros_tools.cli.runner import add_flag, option_parser

_DATABASE_FILES = ("-wal", "-shm", "-journal")
"""Suffixes of the files that SQLite keeps beside a database."""

Work = Callable[[Path, Path, Values], None]
"""A function that reads the bag at the first path and writes the result to the second."""


def compress(argv: Sequence[str]) -> int:
    parser = bag_parser("compress", "Compress one or more bag files.")
    parser.add_option(
        "-j",
        "--bz2",
        action="store_const",
        dest="compression",
        const=BZ2,
        default=BZ2,
        help="use BZ2 compression",
    )
    parser.add_option(
        "--lz4", action="store_const", dest="compression", const=LZ4, help="use lz4 compression"
    )
    return _for_each(parser, argv, _recompress)


def decompress(argv: Sequence[str]) -> int:
    parser = bag_parser("decompress", "Decompress one or more bag files.")
    parser.set_defaults(compression=NONE)
    return _for_each(parser, argv, _recompress)


def reindex(argv: Sequence[str]) -> int:
    parser = bag_parser("reindex", "Reindexes one or more bag files.")
    return _for_each(parser, argv, _reindex, _files_in)


def _files_in(name: str) -> list[str]:
    """Return the files of a ROS 2 bag that is a folder. Other names are returned as they are."""
    found = sorted(Path(name).iterdir()) if os.path.isdir(name) else []
    files = [each for each in found if each.suffix in (".mcap", ".db3") and ".orig." not in each.name]
    return list(map(str, files)) or [name]


def bag_parser(name: str, description: str) -> OptionParser:
    """Return a parser with the options shared by `compress`, `reindex` and similar subcommands."""
    parser = option_parser("rosbag", "", description)
    parser.usage = f"rosbag {name} [options] BAGFILE1 [BAGFILE2 ...]"
    parser.add_option("--output-dir", dest="output_dir", metavar="DIR", help="write to directory DIR")
    add_flag(parser, "-f", "--force", help="force overwriting of backup file if it exists")
    add_flag(parser, "-q", "--quiet", help="suppress noncritical messages")
    return parser


def _for_each(
    parser: OptionParser,
    argv: Sequence[str],
    work: Work,
    files_of: Callable[[str], list[str]] = lambda name: [name],
) -> int:
    options, arguments = parser.parse_args(list(argv))
    if not arguments:
        parser.error("You must specify at least one bag file.")
    status = 0
    if options.output_dir:
        Path(options.output_dir).mkdir(parents=True, exist_ok=True)  # an error is not one of a bag
    files = [(bag, name, number) for bag in arguments for number, name in enumerate(files_of(bag))]
    for bag, name, number in files:
        path = Path(name)
        try:
            if options.output_dir:
                folder = _output_folder(Path(options.output_dir), Path(bag), path)
                if bag != name and not number:
                    _copy_metadata(Path(bag), folder, options)
                work(path, folder / path.name, options)
            else:
                _with_backup(path, options, work)
        except NotIndexed:
            print(f"ERROR bag unindexed: {name}.  Run rosbag reindex.", file=sys.stderr)
            status = 1
        except (OSError, BagError) as error:
            print(f"ERROR reading {name}: {error}", file=sys.stderr)
            status = 1
    return status


def _output_folder(folder: Path, bag: Path, file: Path) -> Path:
    """Create the folder for a rewritten file: for a file of a ROS 2 bag, one with the bag's name."""
    if file != bag:
        folder /= bag.resolve().name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _copy_metadata(bag: Path, folder: Path, options: Values) -> None:
    """Copy the `metadata.yaml` of a ROS 2 bag, or say why it is left out."""
    metadata = bag / "metadata.yaml"
    try:
        content = read_file(metadata)
        with replaced_file(folder / metadata.name) as file:
            file.write(content)
    except FileNotFoundError:
        pass
    except OSError as error:
        _warn([f"{metadata} is left out: {error.strerror or error}"], options)


def _with_backup(path: Path, options: Values, work: Work) -> None:
    """Replace a bag with its rewritten version, and keep the original as `name.orig.bag`.

    If that file exists, skip the bag, unless `--force` is given.
    """
    backup = path.parent / f"{path.stem}.orig{path.suffix}"  # not with_name, which refuses "." and ".."
    if backup.exists() and not options.force:
        if not options.quiet:
            print(f"Skipping {path}. Backup path {backup} already exists.", file=sys.stderr)
        return
    unfinished = path.parent / f"{path.stem}.new{path.suffix}"
    try:
        work(path, unfinished, options)
        replace_file(path, backup)
        for end in _DATABASE_FILES:  # beside the new database, they would damage it
            if path.with_name(path.name + end).exists():
                replace_file(path.with_name(path.name + end), backup.with_name(backup.name + end))
        replace_file(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)


def _recompress(source: Path, target: Path, options: Values) -> None:
    if target.exists() and source.samefile(target):
        raise BagError(f"the output would be the input itself: {target}")
    if not is_ros1_bag(source):
        raise BagError("it is not a ROS 1 bag; rosbag convert --compression compresses other files")
    with BagReader(source) as bag:
        total = sum(bag.chunk_header(number).size for number in range(len(bag.chunks)))
        progress = Progress(str(source), total, is_quiet=options.quiet)
        with replaced_file(target) as file:
            recompress(bag, file, options.compression, progress)
    progress.finish()


def _reindex(source: Path, target: Path, options: Values) -> None:
    progress = Progress(str(source), source.stat().st_size, is_quiet=options.quiet)
    if target.exists() and source.samefile(target):
        raise BagError(f"the output would be the input itself: {target}")
    if source.is_dir():
        packed = any(each.suffix in (".zstd", ".zst") for each in source.iterdir())
        hint = ": they are compressed with zstd; decompress them first" if packed else ""
        raise BagError(f"it is a folder without .mcap or .db3 files{hint}")
    check_no_pointer(source)
    if not is_ros1_bag(source):
        recover = _recover_mcap if is_mcap(source) else _recover_sqlite
        with replaced_file(target) as file:
            damages = recover(source, file, progress)
        progress.finish()
        _warn(damages, options)
        return
    with replaced_file(target) as file:
        with open_file(source) as old:
            read_version(Source(old, str(source)))  # refuse other files before the copy
            old.seek(0)
            shutil.copyfileobj(old, file, 1024 * 1024)
        writer = reindex_file(file, str(source), progress)
        writer.finish()
    progress.finish()
    _warn(writer.layout.damage, options)


def _recover_mcap(source: Path, file: Any, progress: Progress) -> list[str]:
    from pipros_tools.bag.mcap_repair import recover

    return recover(source, file, progress)


def _recover_sqlite(source: Path, file: Any, _: Progress) -> list[str]:
    others = other_bags()
    if others is None:
        raise BagError("this installation cannot read SQLite files")
    return others.recover(source, file)


def _warn(damages: Sequence[str], options: Values) -> None:
    for damage in () if options.quiet else damages:
        print(f"WARNING: {damage}", file=sys.stderr)
