"""POSIX features that other systems lack: file owners, process groups, forks and descriptor limits.

On other systems, the functions do nothing, return a neutral value, or raise `NeedsPosix`. This module checks
`sys.platform` for type checkers, and also whether each name exists, because Python in a browser lacks some of
them. Terminal functions are in `terminals.py`. This module imports little, because the first message import
of each process loads it.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` would take milliseconds
if TYPE_CHECKING:
    import subprocess
    import threading
    from collections.abc import Callable

HAS_OWNERS = hasattr(os, "geteuid")
"""False on Windows, where a profile's folders belong to its user by default."""

_AT_ONCE = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
NO_LINK = getattr(os, "O_NOFOLLOW", 0) | _AT_ONCE
"""Flags for `os.open` that refuse links and do not wait for the other end of a pipe."""
READ = os.O_RDONLY | _AT_ONCE | getattr(os, "O_BINARY", 0)
"""Flags for `os.open` to read a file that may turn out to be a pipe."""

NEW_GROUP = 0x200 if sys.platform == "win32" else 0
"""CREATE_NEW_PROCESS_GROUP, for `creationflags`. Replaces `start_new_session`, which Windows ignores."""

_WINDOWS_CONNECTIONS = 8192


def require_sockets() -> None:
    """Check that this system has sockets and threads, or replacements for them.

    In a browser, the system calls for them fail with various errors, and some never return.

    Raises:
        NeedsSockets: Python runs in a browser.
    """
    if sys.platform == "emscripten":
        from pipros.basics import one_thread
        from pipros.basics.errors import NeedsSockets

        if one_thread.has_threads():
            raise NeedsSockets


def user_id() -> int:
    """Return the process's effective user id.

    On systems without file owners, return 0, which is the `st_uid` of all files there.
    """
    if sys.platform != "win32" and HAS_OWNERS:
        return os.geteuid()
    return 0


def give_to(path: str | os.PathLike[str], user: int, group: int) -> None:
    """Change the owner of a file or folder; do nothing on systems without file owners."""
    if sys.platform != "win32" and HAS_OWNERS:
        os.chown(path, user, group)


def signal_group(group: int, number: int) -> None:
    """Send a signal to a process group; 0 only checks that the group exists.

    Raises:
        OSError: the group does not exist, or belongs to another user.
        NeedsPosix: the system has no process groups.
    """
    if sys.platform != "win32" and hasattr(os, "killpg"):
        os.killpg(group, number)
    else:
        from pipros.basics.errors import NeedsPosix

        raise NeedsPosix("a process group")


def kill_with_group(process: subprocess.Popen[bytes]) -> None:
    """Kill a process, which may already have exited. On POSIX, it must lead a group, which is also killed."""
    if sys.platform != "win32" and hasattr(os, "killpg"):
        import signal

        try:
            os.killpg(process.pid, signal.SIGKILL)
        except (ProcessLookupError, PermissionError):
            return
    else:
        process.kill()


def interrupt(process: subprocess.Popen[bytes]) -> None:
    """Interrupt the first process of a new group as Ctrl-C does: with SIGINT, or with SIGBREAK on Windows.

    SIGBREAK is used because Windows disables Ctrl-C in new groups. If it cannot be sent, for example because
    there is no console, the process is ended.
    """
    import signal

    if sys.platform == "win32":
        try:
            process.send_signal(signal.CTRL_BREAK_EVENT)
        except (OSError, SystemError):  # CPython raises SystemError for an error of Windows (cpython#87128)
            process.terminate()
    else:
        process.send_signal(signal.SIGINT)


def call_in_children(callback: Callable[[], object]) -> None:
    """Register a function to be called at the start of every forked child of this process.

    Does nothing on systems without fork.
    """
    if sys.platform != "win32" and hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=callback)


def hold_while_forking(lock: threading.Lock) -> None:
    """Hold a lock whenever a child is forked, so that no other thread is inside of what it guards.

    Does nothing on systems without fork.
    """
    if sys.platform != "win32" and hasattr(os, "register_at_fork"):
        os.register_at_fork(before=lock.acquire, after_in_parent=lock.release, after_in_child=lock.release)


def call_in_children_before(callback: Callable[[], object], signals: tuple[int, ...]) -> None:
    """Register a function to be called in every forked child, before the child handles any of `signals`.

    Does nothing on systems without fork.
    """
    if sys.platform == "win32" or not hasattr(os, "register_at_fork"):
        return
    import signal
    import threading

    masks = threading.local()

    def block() -> None:
        masks.before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)

    def restore() -> None:
        signal.pthread_sigmask(signal.SIG_SETMASK, masks.before)

    def begin_child() -> None:
        try:
            callback()
        finally:
            restore()

    if hasattr(signal, "pthread_sigmask"):
        os.register_at_fork(before=block, after_in_parent=restore, after_in_child=begin_child)


def descriptor_limit() -> int:
    """Return the maximum number of files and sockets that this process can have open."""
    if sys.platform == "win32":
        return _WINDOWS_CONNECTIONS  # sockets do not count as files on Windows
    try:
        import resource
    except ImportError:
        return _WINDOWS_CONNECTIONS
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return sys.maxsize if soft == resource.RLIM_INFINITY else soft


def raise_descriptor_limit(wanted: int) -> None:
    """Raise the maximum number of open files to `wanted`, or as far as the system allows."""
    if sys.platform == "win32":
        return
    try:
        import resource
    except ImportError:
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY:
        wanted = min(hard, wanted)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def make_room_for_descriptors(count: int) -> None:
    """Make the kernel grow the process's descriptor table now.

    The table doubles when it is full, and on Linux this blocks a process with threads for 10 to 20 ms.
    """
    if sys.platform == "win32":
        return
    try:
        import fcntl

        with open(os.devnull, "rb") as any_file:
            os.close(fcntl.fcntl(any_file.fileno(), fcntl.F_DUPFD_CLOEXEC, count - 1))
    except (ImportError, OSError):
        return
