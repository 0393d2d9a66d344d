"""Write log files that another user cannot redirect, and that tolerate a full disk.

Log folders may be shared. Another user who can write to a log folder could replace a log file with a link.
Lines that contain text from peers would then be appended to the linked file, which could be any file that
the node's user owns.
"""

from __future__ import annotations

import errno
import os
import sys
import threading
from contextlib import suppress
from stat import S_ISCHR, S_ISLNK, S_ISREG

from pipros.basics.limits import Limits, process_limits
from pipros.basics.planted import UntrustedFile, refuse_planted
from pipros.basics.posix import HAS_OWNERS, NO_LINK, user_id
from pipros.basics.warn_once import warn_once

_ROOT = 0
_WRITE = os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0)
_LINKS_FOLLOWED = 10


def open_to_write(path: str | os.PathLike[str], *, append: bool = True) -> int:
    """Open a file for writing and return its descriptor. A new file gets the usual permissions (umask).

    Links that belong to this user or to root are followed; other users' links are not. The file must be a
    regular file without additional hard links, or a device such as `/dev/null`. It may belong to another
    user, so that users can share a log file.

    Args:
        append: whether to keep the file's content.

    Raises:
        UntrustedFile: the path is unsafe; the message states the reason.
        OSError: the file cannot be opened.
    """
    place = os.fspath(path)
    refuse_planted(os.path.dirname(place))
    flags = _WRITE | NO_LINK | (os.O_APPEND if append else 0)
    for _ in range(_LINKS_FOLLOWED):
        try:
            descriptor = os.open(place, flags, 0o666)
            break
        except OSError as error:
            if error.errno not in (errno.ELOOP, errno.EMLINK):
                raise
        folder = os.path.realpath(os.path.dirname(place))
        if folder.startswith("/proc/"):  # the target of /dev/stderr, which may be a pipe
            place = os.path.join(folder, os.path.basename(place))
            return os.open(place, _WRITE | (flags & os.O_APPEND), 0o666)
        place = os.path.join(os.path.dirname(place), _target(place))
    else:
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), place)
    try:
        _check(descriptor, place)
        if not append and S_ISREG(os.fstat(descriptor).st_mode):
            os.ftruncate(descriptor, 0)
        if sys.platform != "win32":
            os.set_blocking(descriptor, True)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _check(descriptor: int, path: str) -> None:
    status = os.fstat(descriptor)
    if S_ISCHR(status.st_mode):
        return
    if not S_ISREG(status.st_mode):
        raise UntrustedFile(errno.EPERM, "it is not a regular file", path)
    if HAS_OWNERS and status.st_nlink > 1:
        raise UntrustedFile(errno.EPERM, "the file must not have additional hard links", path)


def refuse_planted_link(path: str | os.PathLike[str]) -> None:
    """Raise `UntrustedFile` if a path is a link that belongs to neither this user nor root."""
    if HAS_OWNERS:
        _check_link(os.lstat(path), os.fspath(path))


def _check_link(status: os.stat_result, path: str) -> None:
    if S_ISLNK(status.st_mode) and status.st_uid not in (user_id(), _ROOT):
        raise UntrustedFile(errno.EPERM, "it is a link that belongs to another user", path)


def _target(path: str) -> str:
    """Return a link's target; raise `UntrustedFile` if the link belongs to neither this user nor root."""
    if sys.platform != "linux":
        refuse_planted_link(path)
        return os.readlink(path)
    # Use a descriptor, because another user could replace the link after the check.
    link = os.open(path, os.O_PATH | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        _check_link(os.fstat(link), path)
        return os.readlink("", dir_fd=link)
    finally:
        os.close(link)


class LogFile:
    """Appends lines to a file. The file is rotated when it grows too large. Thread-safe.

    A program never ends because of its log. If the file cannot be opened or a line cannot be written, for
    example because the disk is full or the home is read-only, a warning is printed, once for all log files in
    a folder. Further lines are lost silently until writing succeeds again. The number of lost lines is then
    written before the next line.
    """

    def __init__(self, path: str | os.PathLike[str], limits: Limits | None = None) -> None:
        """Open the file. Creates it and its folder if they do not exist. Never raises."""
        self._path = os.fspath(path)
        self._limits = limits or process_limits()
        self._lock = threading.Lock()
        self._lost = 0
        self._ends_inside_line = False
        self._is_closed = False
        self._descriptor: int | None = None
        self._size = 0
        try:
            self._reopen()
        except OSError as error:
            warn_unwritable(self._path, error)

    def write(self, text: str) -> bool:
        """Append whole lines of text. Return whether they were written; never raises.

        After `close`, nothing is written.
        """
        data = text.encode("utf-8", "backslashreplace")
        with self._lock:
            if self._is_closed:
                return False
            try:
                if self._size + len(data) > self._limits.log_bytes and self._size:
                    self._rotate()
                if self._descriptor is None:
                    self._reopen()
                if self._lost:
                    self._append(b"WARNING: %d log entries before this line were lost\n" % self._lost)
                    self._lost = 0
                self._append(data)
            except OSError as error:
                self._lost += text.count("\n")
                warn_unwritable(self._path, error)
                return False
        return True

    def close(self) -> None:
        """Close the file. May be called repeatedly."""
        with self._lock:
            self._is_closed = True
            self._close()

    def _append(self, data: bytes) -> None:
        if self._descriptor is None:
            return
        if self._ends_inside_line:  # the disk became full in the middle of a line
            data = b"\n" + data
        view = memoryview(data)
        while view:
            written = os.write(self._descriptor, view)
            self._size += written
            view = view[written:]
            self._ends_inside_line = len(view) > 0
        self._ends_inside_line = False

    def _rotate(self) -> None:
        self._close()
        for number in range(self._limits.log_files - 1, 0, -1):
            younger = f"{self._path}.{number - 1}" if number > 1 else self._path
            with suppress(OSError):  # a node does not wait for a reader on Windows
                os.replace(younger, f"{self._path}.{number}")
        self._reopen(append=self._limits.log_files > 1)

    def _reopen(self, *, append: bool = True) -> None:
        os.makedirs(os.path.dirname(self._path) or ".", exist_ok=True)  # it may have been deleted
        self._descriptor = open_to_write(self._path, append=append)
        self._size = os.fstat(self._descriptor).st_size
        self._ends_inside_line = False

    def _close(self) -> None:
        descriptor, self._descriptor = self._descriptor, None
        self._size = 0
        if descriptor is not None:
            with suppress(OSError):
                os.close(descriptor)


def warn_unwritable(path: str | os.PathLike[str], error: OSError) -> None:
    """Warn that a log file cannot be written, once for all files in a folder."""
    warn_once(
        f"WARNING: cannot write to log file [{os.fspath(path)}]: {error.strerror}. Lines are lost until "
        "writing succeeds again. Free some space, or set ROS_LOG_DIR to a writable location",
        about=f"log files in {os.path.dirname(path)}",
    )
