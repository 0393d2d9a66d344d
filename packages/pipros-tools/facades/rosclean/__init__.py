"""Python API of `rosclean`: measure the disk space that log files use.

Facade of `pipros.basics.log_folders`; see http://wiki.ros.org/rosclean.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from pipros.basics import log_folders as _logs
from pipros_tools.cli.rosclean import main as _main

__all__ = ["CleanupException", "get_disk_usage", "get_human_readable_disk_usage", "rosclean_main"]


class CleanupException(Exception):
    """The size of a folder cannot be determined."""


def get_disk_usage(d: str) -> int:
    """Return the total size in bytes of all files and folders below `d`.

    Raises CleanupException if `d` is not a folder.
    """
    return _logs.size_of(_folder(d))


def get_human_readable_disk_usage(d: str) -> str:
    """Return the disk usage in the format of `du -h`, such as `8.7M`.

    Raises CleanupException if `d` is not a folder.
    """
    return _logs.readable(_logs.disk_usage(_folder(d)))


def rosclean_main(argv: Sequence[str] | None = None) -> None:
    """Run the command. `argv` starts with the command's name. Raises SystemExit if an error occurs."""
    code = _main(list(sys.argv if argv is None else argv)[1:])
    if code:
        sys.exit(code)


def _folder(d: str) -> Path:
    if not Path(d).is_dir():
        raise CleanupException(f"[{d}] must be a folder")
    return Path(d)


def _ask(comment: str) -> bool:
    """Ask the user for confirmation on standard input. Return True for y or yes."""
    sys.stdout.write(f"Okay to perform:\n\n{comment}\n(y/n)?\n")
    sys.stdout.flush()
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _get_check_dirs() -> list[tuple[str, str]]:
    """Return the existing log folders with their descriptions."""
    return [(str(folder), label) for folder, label in _logs.log_folders()]


def _sort_file_by_oldest(d: str) -> list[str]:
    """Return the names in a folder, sorted by modification time, oldest first."""
    return [path.name for path in _logs.oldest_first(_folder(d))]
