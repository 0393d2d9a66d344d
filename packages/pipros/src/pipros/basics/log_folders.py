"""Log folders: their paths, their sizes, and their oldest files."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path

from pipros.basics.env import Environment

_BLOCK_BYTES = 512  # the unit of st_blocks, on every system that has it


def log_folders(environment: Environment | None = None) -> list[tuple[Path, str]]:
    """Return the existing log folders, each with Noetic's description of it."""
    environment = environment or Environment.from_os()
    known = [(environment.log_dir, "ROS node logs"), (environment.ros_home / "rosmake", "rosmake logs")]
    return [(folder, label) for folder, label in known if os.path.isdir(folder)]


def size_of(folder: Path) -> int:
    """Return the total size in bytes of the entries below a folder, as counted by `du -b`.

    Links are not followed.
    """
    return sum(entry.st_size for entry in _entries(folder))


def disk_usage(folder: Path) -> int:
    """Return the disk usage of a folder in bytes, as counted by `du`."""
    return sum(getattr(entry, "st_blocks", 0) * _BLOCK_BYTES for entry in _entries(folder)) or size_of(folder)


def _entries(folder: Path) -> Iterator[os.stat_result]:
    for place, _, files in os.walk(folder):
        for path in (place, *(os.path.join(place, name) for name in files)):
            try:
                yield os.lstat(path)
            except OSError:
                continue  # the entry has just been deleted


def readable(size: int) -> str:
    """Return a size as `du -h` writes it, rounded up: `544K`, `8.7M`.

    >>> readable(0), readable(4096), readable(9_000_000), readable(15_000_000)
    ('0', '4.0K', '8.6M', '15M')
    """
    amount, units = float(size), ["", "K", "M", "G", "T"]
    while amount >= 1024 and len(units) > 1:
        amount /= 1024
        units.pop(0)
    if units[0] and math.ceil(amount * 10) < 100:
        return f"{math.ceil(amount * 10) / 10:.1f}{units[0]}"
    return f"{math.ceil(amount)}{units[0]}"


def oldest_first(folder: Path) -> list[Path]:
    """Return the entries of a folder, except links, sorted by modification time."""
    entries = [(entry.lstat().st_mtime, entry) for entry in folder.iterdir() if not entry.is_symlink()]
    return [entry for _, entry in sorted(entries)]
