"""`rosclean`: reports the size of log files, and deletes them."""

from __future__ import annotations

import shutil
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.log_folders import disk_usage, log_folders, oldest_first, readable, size_of
from pipros.basics.names import without_launch_arguments
from pipros_tools.cli.entry_point import command

_MEGABYTE = 1024 * 1024


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand and return its exit code."""
    parser = ArgumentParser(prog="rosclean")
    subcommands = parser.add_subparsers(dest="command", required=True, metavar="{check,purge}")
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
    options = parser.parse_args(without_launch_arguments(sys.argv[1:] if argv is None else argv))
    code = 0
    for folder, label in log_folders():
        if options.command == "check":
            print(f"{readable(disk_usage(folder))} {label}")
        else:
            code = _purge(folder, label, options.size, is_confirmed=options.is_confirmed) or code
    return code


def _purge(folder: Path, label: str, limit_mb: int | None, *, is_confirmed: bool) -> int:
    if limit_mb is None:
        print(f"Purging {label}.")
        question = f"rm -rf {folder}"
    else:
        size_mb = size_of(folder) // _MEGABYTE
        if size_mb <= limit_mb:
            print(
                f"Directory size of {label} is {size_mb} MB which is already below the requested threshold "
                f"of {limit_mb} MB."
            )
            return 0
        print(f"Purging {label} until directory size is at most {limit_mb} MB (currently {size_mb} MB).")
        question = f"Purge some of old logs in {folder}"
    if not is_confirmed:
        print("PLEASE BE CAREFUL TO VERIFY THE COMMAND BELOW!")
        print(f"Okay to perform:\n\n{question}\n(y/n)?")
        if sys.stdin.readline().strip().lower() not in ("y", "yes"):
            return 0
    try:
        if limit_mb is None and folder.is_symlink():
            folder.unlink()  # as `rm -rf` does
        elif limit_mb is None:
            shutil.rmtree(folder)
        else:
            _delete_oldest(folder, limit_mb * _MEGABYTE)
    except OSError as error:
        print(f"ERROR: cannot delete [{error.filename}]: {error.strerror}", file=sys.stderr)
        return 1
    return 0


def _delete_oldest(logs: Path, limit: int) -> None:
    """Delete the folder's entries, oldest first, until its size is at most `limit` bytes."""
    size = size_of(logs)
    for entry in oldest_first(logs):
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
