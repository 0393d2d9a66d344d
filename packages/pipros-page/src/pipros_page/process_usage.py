"""Resource usage of processes on this machine, read from `/proc` on Linux.

psutil, which supports other systems too, is a compiled package that few users of the page have installed.
"""

from __future__ import annotations

import contextlib
import os
import sys
from dataclasses import dataclass
from pathlib import Path

PROC = Path("/proc")
# Positions in /proc/PID/stat after the process name, which ends at the last parenthesis; see proc(5).
_USER_TICKS, _SYSTEM_TICKS, _THREADS, _START_TICKS, _PAGES = 11, 12, 17, 19, 21


@dataclass(frozen=True, slots=True)
class ProcessUsage:
    """Resource usage of a process at one point in time.

    Attributes:
        processor_s: processor time since its start.
        memory_bytes: resident memory.
        threads: number of threads.
        files: number of open descriptors; None for a process of another user.
        start: start time, in clock ticks after the system's start. Distinguishes successive processes with
            the same id.
    """

    processor_s: float
    memory_bytes: int
    threads: int
    files: int | None
    start: int


def has_proc() -> bool:
    """Return whether this system has Linux's `/proc`."""
    return (PROC / "self" / "stat").exists()


def usage_of(pid: int) -> ProcessUsage | None:
    """Return a process's resource usage, or None if the process does not exist or is a zombie."""
    if sys.platform == "win32":
        return None
    try:
        text = (PROC / str(pid) / "stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    state, *values = text.rpartition(")")[2].split()
    if state in "ZX":
        return None
    numbers = [0, *map(int, values)]
    files = None
    with contextlib.suppress(OSError):
        files = len(os.listdir(PROC / str(pid) / "fd"))
    return ProcessUsage(
        (numbers[_USER_TICKS] + numbers[_SYSTEM_TICKS]) / os.sysconf("SC_CLK_TCK"),
        numbers[_PAGES] * os.sysconf("SC_PAGE_SIZE"),
        numbers[_THREADS],
        files,
        numbers[_START_TICKS],
    )
