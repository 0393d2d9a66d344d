"""Sees to it that no process outlives the launcher that started it, not even when that is killed.

The launcher starts one small interpreter that reads a pipe. Through the pipe it learns which process
groups run; the end of the pipe is the end of the launcher, however it came about, and then what still runs is
ended: SIGTERM, and a second later SIGKILL. On Linux it also looks for processes that carry a mark in their
environment: one that was started in the very moment in which the launcher was killed, or that left its group.

Why not the parent-death signal of Linux: it reaches the direct child only, not the programs behind a
launch prefix or a shell script; it comes when the *thread* that started the child ends; to ask for it,
code must run between fork and exec, which a process with threads cannot do safely; and macOS has none.

This file is also that small program, run as a script with `python -I -S`; so it imports little.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    import subprocess

_ON_POSIX = os.name == "posix"
_GRACE_S = 1.0
_LOOK_EVERY_S = 0.02


class Guardian:
    """The launcher's side. Does nothing on Windows, where process groups of this kind do not exist.

    `started` and `ended` may be called from any thread. Nothing goes wrong when the guardian itself is
    killed; only its protection is gone.
    """

    def __init__(self, mark: str = "") -> None:
        """Nothing is started yet.

        Args:
            mark: `NAME=value` that is in the environment of all processes of this launcher and of no other's.
        """
        self._mark = mark
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Starts the guarding process, in a session of its own, so that no Ctrl-C reaches it."""
        if not _ON_POSIX or self._process is not None:
            return
        import subprocess

        self._process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-I", "-S", os.path.abspath(__file__), self._mark],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )

    def started(self, group: int) -> None:
        """A process group to guard; its number is that of its first process."""
        self._tell(f"+{group}\n")

    def ended(self, group: int) -> None:
        """A process group that is gone. To be called before its number can be given to another."""
        self._tell(f"-{group}\n")

    def stop(self) -> None:
        """Ends the guarding process. What is still guarded then is ended, too."""
        process, self._process = self._process, None
        if process is not None:
            with contextlib.suppress(OSError):
                process.communicate()

    def _tell(self, line: str) -> None:
        if self._process is None or self._process.stdin is None:
            return
        # One write of a few bytes: lines of several threads cannot mix.
        with contextlib.suppress(OSError, ValueError):
            os.write(self._process.stdin.fileno(), line.encode())


def read_groups(lines: IO[str]) -> set[int]:
    """The groups that still run when the lines end."""
    groups: set[int] = set()
    for line in lines:
        with contextlib.suppress(ValueError):
            group = int(line[1:])
            if group > 1:
                (groups.add if line[0] == "+" else groups.discard)(group)
    return groups


def end(groups: set[int], mark: str = "") -> None:
    """SIGTERM to the groups and to the marked processes, SIGKILL to what is still there after a second."""
    deadline = time.monotonic() + _GRACE_S
    left = {group for group in groups if _signal_group(group, signal.SIGTERM)}
    for process in marked_processes(mark):
        _signal(process, signal.SIGTERM)
    while (left or marked_processes(mark)) and time.monotonic() < deadline:
        time.sleep(_LOOK_EVERY_S)
        left = {group for group in left if _signal_group(group, 0)}
    for group in left:
        _signal_group(group, signal.SIGKILL)
    for process in marked_processes(mark):
        _signal(process, signal.SIGKILL)


def marked_processes(mark: str) -> list[int]:
    """The processes with the mark in their environment; none where the system does not tell."""
    if not mark or not os.path.isdir("/proc/self"):
        return []
    found = []
    for name in os.listdir("/proc"):
        if not name.isdigit() or int(name) == os.getpid():
            continue
        with contextlib.suppress(OSError), open(f"/proc/{name}/environ", "rb") as file:
            if mark.encode() in file.read().split(b"\0"):
                found.append(int(name))
    return found


def _signal_group(group: int, number: int) -> bool:
    """True when there was a group to send the signal to."""
    try:
        os.killpg(group, number)
    except OSError:
        return False
    return True


def _signal(process: int, number: int) -> None:
    with contextlib.suppress(OSError):
        os.kill(process, number)


if __name__ == "__main__":
    for ignored in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    end(read_groups(sys.stdin), sys.argv[1])
