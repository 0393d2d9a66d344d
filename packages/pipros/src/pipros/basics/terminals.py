"""Read single keys from POSIX terminals, and open pseudoterminals (ptys) for other processes' output."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator

from pipros.basics.errors import NeedsPosix

HAS_PTYS = hasattr(os, "openpty")


@contextlib.contextmanager
def single_keys(*, of_launcher: bool = False) -> Iterator[bool]:
    """Make standard input deliver single keys without echo. Yield False if there is no foreground terminal.

    If `of_launcher` is true, also accept the terminal of the roslaunch that started the program. This
    terminal belongs to another session.
    """
    if sys.platform == "win32":
        yield False
        return
    try:
        import termios
    except ImportError:
        yield False
        return
    try:
        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)
        try:
            is_usable = os.tcgetpgrp(descriptor) == os.getpgrp()
        except OSError:
            is_usable = of_launcher
    except (OSError, ValueError, AttributeError, termios.error):
        is_usable = False
    if not is_usable:
        yield False
        return
    changed = termios.tcgetattr(descriptor)
    changed[3] &= ~(termios.ICANON | termios.ECHO)
    termios.tcsetattr(descriptor, termios.TCSANOW, changed)
    try:
        yield True
    finally:
        termios.tcsetattr(descriptor, termios.TCSANOW, before)


def discard_input(descriptor: int) -> None:
    """Discard what was typed into a terminal and has not been read yet, including a begun line."""
    if sys.platform == "win32":
        return
    with contextlib.suppress(ImportError, OSError):
        import termios

        with contextlib.suppress(termios.error):  # not a terminal
            termios.tcflush(descriptor, termios.TCIFLUSH)


def open_pty(like: int) -> tuple[int, int]:
    """Open a pty that has the size of another terminal, and that neither echoes nor changes bytes.

    Returns:
        The end to read from, and the end to write to.

    Raises:
        OSError: the system has no free pty.
        NeedsPosix: the system has no ptys.
    """
    if sys.platform == "win32" or not HAS_PTYS:
        raise NeedsPosix("a pty")
    import fcntl
    import termios

    read_end, write_end = os.openpty()
    with contextlib.suppress(OSError, termios.error):
        size = fcntl.ioctl(like, termios.TIOCGWINSZ, b"\0" * 8)
        fcntl.ioctl(write_end, termios.TIOCSWINSZ, size)
    with contextlib.suppress(termios.error):
        settings = termios.tcgetattr(write_end)
        settings[1] &= ~termios.OPOST
        settings[3] &= ~termios.ECHO
        termios.tcsetattr(write_end, termios.TCSANOW, settings)
    return read_end, write_end


def is_raw(terminal: int) -> bool:
    """Return True if the terminal is in raw mode, in which it does not add carriage returns."""
    if sys.platform != "win32":
        import termios

        with contextlib.suppress(OSError, termios.error):
            return not termios.tcgetattr(terminal)[1] & termios.OPOST
    return False
