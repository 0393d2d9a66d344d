"""Ends all processes of a launcher when the launcher ends, even when it is killed.

The launcher starts one small interpreter that reads a pipe. Through the pipe it learns which process groups
run. When the pipe is closed the launcher has ended, whatever the reason, and what still runs gets SIGTERM
and, a second later, SIGKILL. On Linux the guardian also looks for processes with a tag in their environment:
one that was started at the moment when the launcher was killed, or that left its group.

Why not the parent-death signal of Linux: it reaches the direct child only, not the programs behind a launch
prefix or a shell script; it is sent when the *thread* that started the child ends; setting it needs code
between fork and exec, which is unsafe in a process with threads; and macOS does not have it.

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

SIGKILL: signal.Signals = getattr(signal, "SIGKILL", signal.SIGTERM)
_ON_POSIX = os.name == "posix"
_GRACE_S = 1.0
_CHECK_EVERY_S = 0.02


class Guardian:
    """The launcher's side. Does nothing on Windows, where such process groups do not exist.

    `started` and `ended` may be called from any thread. When the guardian itself is killed, the launcher
    goes on without its protection.
    """

    def __init__(self, tag: str = "") -> None:
        """Nothing is started yet.

        Args:
            tag: a variable `NAME=value` that the processes of this launcher have, and no others.
        """
        self._tag = tag
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Starts the guarding process, in a session of its own, so that Ctrl-C does not reach it."""
        if not _ON_POSIX or self._process is not None:
            return
        import subprocess

        self._process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-I", "-S", os.path.abspath(__file__), self._tag],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )

    def started(self, group: int) -> None:
        """Adds a process group; its number is that of its first process."""
        self._send(f"+{group}\n")

    def ended(self, group: int) -> None:
        """Removes a process group. To be called before its number can be used again."""
        self._send(f"-{group}\n")

    def stop(self) -> None:
        """Ends the guarding process. It ends the groups that are left first."""
        process, self._process = self._process, None
        if process is not None:
            with contextlib.suppress(OSError):
                process.communicate()

    def _send(self, line: str) -> None:
        if self._process is None or self._process.stdin is None:
            return
        # One write of a few bytes is atomic: lines of several threads cannot mix.
        with contextlib.suppress(OSError, ValueError):
            os.write(self._process.stdin.fileno(), line.encode())


def read_groups(lines: IO[str]) -> set[int]:
    """The groups that are left when the lines end."""
    groups: set[int] = set()
    for line in lines:
        with contextlib.suppress(ValueError):
            group = int(line[1:])
            if group > 1:
                (groups.add if line[0] == "+" else groups.discard)(group)
    return groups


def end(groups: set[int], tag: str = "") -> None:
    """Sends SIGTERM to groups and tagged processes, and SIGKILL to those left after a second."""
    deadline = time.monotonic() + _GRACE_S
    left = {group for group in groups if _signal_group(group, signal.SIGTERM)}
    for process in tagged_processes(tag):
        _signal(process, signal.SIGTERM)
    while (left or tagged_processes(tag)) and time.monotonic() < deadline:
        time.sleep(_CHECK_EVERY_S)
        left = {group for group in left if _signal_group(group, 0)}
    for group in left:
        _signal_group(group, SIGKILL)
    for process in tagged_processes(tag):
        _signal(process, SIGKILL)


def tagged_processes(tag: str) -> list[int]:
    """The processes with the tag in their environment; none on systems without /proc."""
    if not tag or not os.path.isdir("/proc/self"):
        return []
    found = []
    for name in os.listdir("/proc"):
        if not name.isdigit() or int(name) == os.getpid():
            continue
        with contextlib.suppress(OSError), open(f"/proc/{name}/environ", "rb") as file:
            if tag.encode() in file.read().split(b"\0"):
                found.append(int(name))
    return found


def _signal_group(group: int, number: int) -> bool:
    """Whether the group existed."""
    if sys.platform == "win32":
        return False
    try:
        os.killpg(group, number)
    except OSError:
        return False
    return True


def _signal(process: int, number: int) -> None:
    with contextlib.suppress(OSError):
        os.kill(process, number)


if __name__ == "__main__":
    for ignored in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        signal.signal(ignored, signal.SIG_IGN)
    end(read_groups(sys.stdin), sys.argv[1])
