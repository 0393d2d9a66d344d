"""Kills all of a launcher's processes when the launcher exits, even if it is killed.

The launcher starts one small interpreter and writes the ids of running process groups to its standard input.
When that pipe closes, the launcher has exited, for whatever reason. The guardian then sends SIGTERM to
everything still running, and SIGKILL a second later. On Linux it also looks for processes with a tag in their
environment, because a process may have been started just as the launcher was killed, or have left its group.

Linux's parent-death signal is not used for several reasons: it reaches only the direct child, not the
programs behind a launch prefix or a shell script; it is sent when the *thread* that started the child exits;
setting it requires code between fork and exec, which is unsafe in a process with threads; and macOS lacks it.

The interpreter runs this file as a script, with `python -I -S`, so the file imports little.
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
    """The launcher's side of the guardian. Does nothing on Windows, where `Job` replaces it.

    `started` and `ended` may be called from any thread. If the guardian itself is killed, the launcher
    continues without this protection.
    """

    def __init__(self, tag: str = "") -> None:
        """Create a guardian. Call `start()` to start its process.

        Args:
            tag: an environment variable, as `NAME=value`, that is set in all processes of this launcher and
                in no others.
        """
        self._tag = tag
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start the guardian process, in its own session so that Ctrl-C does not reach it.

        Does nothing without threads: there, the hub ends what a stopped launcher has started.
        """
        from pipros.basics import one_thread

        if not _ON_POSIX or self._process is not None or not one_thread.has_threads():
            return
        import subprocess

        self._process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-I", "-S", os.path.abspath(__file__), self._tag],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )

    def started(self, group: int) -> None:
        """Add a process group. Its number is the id of its first process."""
        self._send(f"+{group}\n")

    def ended(self, group: int) -> None:
        """Remove a process group. Must be called before the system can reuse its number."""
        self._send(f"-{group}\n")

    def stop(self) -> None:
        """Stop the guardian process, which first kills the remaining groups."""
        process, self._process = self._process, None
        if process is not None:
            with contextlib.suppress(OSError):
                process.communicate()

    def _send(self, line: str) -> None:
        if self._process is None or self._process.stdin is None:
            return
        # A single write of a few bytes is atomic, so lines from several threads cannot mix.
        with contextlib.suppress(OSError, ValueError):
            os.write(self._process.stdin.fileno(), line.encode())


def read_groups(lines: IO[str]) -> set[int]:
    """Return the groups that are still running when the input ends."""
    groups: set[int] = set()
    for line in lines:
        with contextlib.suppress(ValueError):
            group = int(line[1:])
            if group > 1:
                (groups.add if line[0] == "+" else groups.discard)(group)
    return groups


def end(groups: set[int], tag: str = "") -> None:
    """Send SIGTERM to groups and tagged processes, and SIGKILL to those still running after a second."""
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
    """Return the ids of other processes with the tag in their environment; empty on systems without /proc."""
    if not tag or not os.path.isdir("/proc/self"):
        return []
    found = []
    for name in os.listdir("/proc"):
        if not name.isdigit() or int(name) == os.getpid():
            continue
        with contextlib.suppress(OSError), open(f"/proc/{name}/environ", "rb") as file:
            if os.fsencode(tag) in file.read().split(b"\0"):
                found.append(int(name))
    return found


def _signal_group(group: int, number: int) -> bool:
    """Send a signal and return whether the group exists."""
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
