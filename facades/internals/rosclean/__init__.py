"""`rosclean` for Python code: how much space the log files take.

Facade of `pipros.basics.log_folders`; see http://wiki.ros.org/rosclean.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from pipros.basics import log_folders as _logs
from pipros.basics.lazy_names import star_names as _star_names
from pipros.cli.rosclean import main as _main

__all__ = ["CleanupException", "get_disk_usage", "get_human_readable_disk_usage", "rosclean_main"]

_star_names(__name__, "argparse distutils.spawn:find_executable os platform rospkg subprocess sys")


class CleanupException(Exception):
    """A folder cannot be measured."""


def get_disk_usage(d: str) -> int:
    """The bytes in all files and folders below `d`. Raises CleanupException without the folder."""
    return _logs.size_of(_folder(d))


def get_human_readable_disk_usage(d: str) -> str:
    """What they take on the disk, as `du -h` writes it: `8.7M`. Raises CleanupException as above."""
    return _logs.readable(_logs.disk_usage(_folder(d)))


def rosclean_main(argv: Sequence[str] | None = None) -> None:
    """The command; `argv` begins with its name. Ends with SystemExit when something went wrong."""
    code = _main(list(sys.argv if argv is None else argv)[1:])
    if code:
        sys.exit(code)


def _folder(d: str) -> Path:
    if not Path(d).is_dir():
        raise CleanupException(f"[{d}] must be a folder")
    return Path(d)


def _ask(comment: str) -> bool:
    """Asks a person on standard input; True for y or yes."""
    sys.stdout.write(f"Okay to perform:\n\n{comment}\n(y/n)?\n")
    sys.stdout.flush()
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _get_check_dirs() -> list[tuple[str, str]]:
    """The existing log folders, each with its description."""
    return [(str(folder), label) for folder, label in _logs.log_folders()]


def _sort_file_by_oldest(d: str) -> list[str]:
    """The names in a folder, sorted by the time of their last change."""
    return [path.name for path in _logs.oldest_first(_folder(d))]
