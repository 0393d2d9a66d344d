"""`rosclean`: shows the size of the log files, and deletes old ones."""

from __future__ import annotations

import os
import shutil
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from pipros.cli.streams import command
from pipros.env import Environment

_MEGABYTE = 1024 * 1024


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Runs a subcommand and returns its exit code."""
    parser = ArgumentParser(prog="rosclean")
    subcommands = parser.add_subparsers(dest="command", required=True)
    subcommands.add_parser("check", help="Check usage of log files")
    purge = subcommands.add_parser("purge", help="Remove log files")
    purge.add_argument(
        "-y",
        dest="is_confirmed",
        action="store_true",
        help="CAUTION: automatically confirms all questions to delete files",
    )
    purge.add_argument(
        "--size", type=int, help="Maximum total size in MB to keep when deleting old files", metavar="SIZE"
    )
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    logs = Environment.from_os().log_dir
    if not logs.is_dir():
        return 0
    if options.command == "check":
        print(f"{readable(size_of(logs))} ROS node logs")
        return 0
    return _purge(logs, options.size, is_confirmed=options.is_confirmed)


def size_of(folder: Path) -> int:
    """The size of a folder in bytes; links are not followed."""
    total = 0
    for place, _, files in os.walk(folder):
        for name in files:
            try:
                total += os.lstat(os.path.join(place, name)).st_size
            except OSError:
                continue  # it was deleted meanwhile
    return total


def readable(size: int) -> str:
    """A size as `du -h` writes it: `544K`, `8.7M`."""
    amount, units = float(size), ["", "K", "M", "G", "T"]
    while amount >= 1024 and len(units) > 1:
        amount /= 1024
        units.pop(0)
    return f"{amount:.1f}{units[0]}" if units[0] and amount < 10 else f"{amount:.0f}{units[0]}"


def _purge(logs: Path, limit_mb: int | None, *, is_confirmed: bool) -> int:
    if limit_mb is None:
        print("Purging ROS node logs.")
        question = f"rm -rf {logs}"
    else:
        size = size_of(logs)
        print(
            f"Purging ROS node logs until directory size is at most {limit_mb} MB "
            f"(currently {size // _MEGABYTE} MB)."
        )
        if size <= limit_mb * _MEGABYTE:
            print("Directory size is already below the limit.")
            return 0
        question = f"Purge some of old logs in {logs}"
    if not is_confirmed:
        print("PLEASE BE CAREFUL TO VERIFY THE COMMAND BELOW!")
        print(f"Okay to perform:\n\n{question}\n(y/n)?")
        if sys.stdin.readline().strip().lower() not in ("y", "yes"):
            return 0
    try:
        if limit_mb is None:
            shutil.rmtree(logs)
        else:
            _delete_oldest(logs, limit_mb * _MEGABYTE)
    except OSError as error:
        print(f"ERROR: cannot delete [{error.filename}]: {error.strerror}", file=sys.stderr)
        return 1
    return 0


def _delete_oldest(logs: Path, limit: int) -> None:
    """Deletes entries, the oldest first, until the folder is small enough."""
    entries = sorted((entry.lstat().st_mtime, entry) for entry in logs.iterdir() if not entry.is_symlink())
    size = size_of(logs)
    for _, entry in entries:
        if size <= limit:
            break
        size -= size_of(entry) if entry.is_dir() else entry.lstat().st_size
        if entry.is_dir():
            shutil.rmtree(entry)
        else:
            entry.unlink()
    latest = logs / "latest"
    if latest.is_symlink() and not latest.exists():
        latest.unlink()


if __name__ == "__main__":
    sys.exit(main())
