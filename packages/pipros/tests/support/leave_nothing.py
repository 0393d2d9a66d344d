"""Run a command, and end all programs that it leaves: `python -m tests.support.leave_nothing COMMAND…`.

Tests start programs in sessions and with environments of their own: neither Ctrl-C nor a signal to a process
group reaches them, so a run of tests that is stopped would leave them. On Linux, orphans become children of
this process, which ends them after the command, however that ended. Only SIGKILL of this process leaves them.
"""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_FROM_TERMINAL = 128  # SI_KERNEL: Ctrl-C, which the command receives itself
_PR_SET_CHILD_SUBREAPER = 36
_GRACE_S = 3.0
_STEP_S = 0.05


def main(command: list[str]) -> int:
    """Run the command. Return its exit code, or 128 and the number of the signal that ended it."""
    if not sys.platform.startswith("linux"):
        return subprocess.call(command)
    ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    awaited = {*STOPPING, signal.SIGCHLD}
    signal.pthread_sigmask(signal.SIG_BLOCK, awaited)
    child = subprocess.Popen(command, preexec_fn=lambda: signal.pthread_sigmask(signal.SIG_UNBLOCK, awaited))
    while child.poll() is None:
        received = signal.sigtimedwait(awaited, 1.0)
        if received and received.si_signo in STOPPING and received.si_code != _FROM_TERMINAL:
            child.send_signal(received.si_signo)
        reap_orphans(child.pid)
    end_descendants()
    return child.returncode if child.returncode >= 0 else 128 - child.returncode


def reap_orphans(child: int) -> None:
    """Wait for ended children other than `child`, which tests would otherwise still find in /proc."""
    while (ended := os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)) and ended.si_pid != child:
        os.waitpid(ended.si_pid, 0)


def end_descendants() -> None:
    """Send SIGTERM to all descendants of this process, then SIGKILL, until none is left."""
    killing_from = time.monotonic() + _GRACE_S
    while left := descendants():
        for pid in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGTERM if time.monotonic() < killing_from else signal.SIGKILL)
        time.sleep(_STEP_S)
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass


def descendants() -> set[int]:
    """Return the process ids of all descendants of this process."""
    children: dict[int, list[int]] = defaultdict(list)
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            children[parent].append(int(folder.name))
    found: set[int] = set()
    waiting = [os.getpid()]
    while waiting:
        of_one = children[waiting.pop()]
        found.update(of_one)
        waiting += of_one
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
