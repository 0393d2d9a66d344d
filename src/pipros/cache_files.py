"""Files that one process keeps for the next one, in a folder that only this user can have written to.

What is read back decides which programs run and is in part code, so nothing is taken from a place where
another user could have put it. It imports next to nothing: the first import of a message waits for it.
"""

from __future__ import annotations

import errno
import os
from stat import S_ISDIR, S_ISREG

_HAS_OWNERS = hasattr(os, "getuid")  # not on Windows, where a profile's folders are its user's by default
_OTHERS_MAY_WRITE = 0o022
_NO_LINK = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
_READ = os.O_RDONLY | _NO_LINK | getattr(os, "O_BINARY", 0)
_MAKE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NO_LINK | getattr(os, "O_BINARY", 0)
_ENTER = os.O_RDONLY | _NO_LINK | getattr(os, "O_DIRECTORY", 0)


class Untrusted(PermissionError):
    """Another user could have written a file, or what is in a folder."""


class CacheFolder:
    """A folder for files without folders in it, used together with the folder that holds it.

    Both must belong to this user and be writable for nobody else, and neither may be a symbolic link. The
    same holds for a file that is read, which must also have one name only. Folders above those two may be
    links and belong to anybody: whoever can exchange them cannot make folders of ours. What fails the test
    is not used, and that is said once on standard error. A cache that is missing, full or read-only is
    done without.

    Files are replaced in one step, so any number of processes may share the folder.
    """

    __slots__ = ("_path",)

    def __init__(self, path: str) -> None:
        self._path = path

    def read(self, name: str) -> bytes | None:
        """The content of a file; None when it is missing or not to be trusted."""
        try:
            if not _HAS_OWNERS:
                return _read_plain(os.path.join(self._path, name))
            folder = self._open()
            try:
                return _read_own(name, folder, self._path)
            finally:
                os.close(folder)
        except Untrusted as error:
            _warn(error)
        except OSError:
            pass
        return None

    def write(self, name: str, content: bytes) -> None:
        """Makes or replaces a file, readable for this user only, if that is possible."""
        unfinished = f".{name}.{os.urandom(6).hex()}"
        try:
            self._make()
            if not _HAS_OWNERS:
                _replace(os.path.join(self._path, unfinished), os.path.join(self._path, name), content, None)
                return
            folder = self._open()
            try:
                _replace(unfinished, name, content, folder)
            finally:
                os.close(folder)
        except Untrusted as error:
            _warn(error)
        except OSError:
            pass

    def _open(self) -> int:
        """A descriptor of the folder.

        Raises:
            Untrusted: it, or the folder that holds it, could be another user's work.
            OSError: it is not there.
        """
        above_path, name = os.path.split(self._path)
        above = _enter(above_path, None, above_path)
        try:
            return _enter(name, above, self._path)
        finally:
            os.close(above)

    def _make(self) -> None:
        missing = []
        folder = self._path
        while not os.path.lexists(folder):
            missing.append(folder)
            folder = os.path.dirname(folder)
        # In somebody else's folder nothing is made: root would leave there what its owner cannot use.
        if missing and _HAS_OWNERS and os.stat(folder).st_uid != os.getuid():
            raise PermissionError(f"{folder} belongs to another user")
        for path in reversed(missing):
            try:  # contextlib would take its time to import
                os.mkdir(path, 0o700)
            except FileExistsError:  # another process was quicker
                continue


def _enter(name: str, above: int | None, path: str) -> int:
    try:
        folder = os.open(name, _ENTER, dir_fd=above)
    except OSError as error:
        # What a link answers to O_NOFOLLOW and O_DIRECTORY differs between systems.
        if error.errno in (errno.ELOOP, errno.ENOTDIR, errno.EMLINK):
            raise Untrusted(f"{path} is a symbolic link or not a folder") from None
        raise
    try:
        status = os.fstat(folder)
        if not S_ISDIR(status.st_mode):
            raise Untrusted(f"{path} is not a folder")
        check_owner(status, path)
    except BaseException:
        os.close(folder)
        raise
    return folder


def _read_own(name: str, folder: int, folder_path: str) -> bytes:
    path = os.path.join(folder_path, name)
    try:
        descriptor = os.open(name, _READ, dir_fd=folder)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.EMLINK):
            raise Untrusted(f"{path} is a symbolic link") from None
        raise
    with open(descriptor, "rb", buffering=0) as file:
        status = os.fstat(descriptor)
        if not S_ISREG(status.st_mode):
            raise Untrusted(f"{path} is not a regular file")
        if status.st_nlink != 1:
            raise Untrusted(f"{path} has a second name elsewhere (a hard link)")
        check_owner(status, path)
        return file.readall()


def check_owner(status: os.stat_result, path: str) -> None:
    """Raises Untrusted unless a file or folder belongs to this user, and nobody else may write to it."""
    if status.st_uid != os.getuid():
        raise Untrusted(f"{path} belongs to another user (uid {status.st_uid})")
    if status.st_mode & _OTHERS_MAY_WRITE:
        raise Untrusted(f"{path} is writable for other users")


def _read_plain(path: str) -> bytes:
    if os.path.islink(path) or not os.path.isfile(path):
        raise FileNotFoundError(path)
    with open(path, "rb") as file:
        return file.read()


def _replace(unfinished: str, name: str, content: bytes, folder: int | None) -> None:
    descriptor = os.open(unfinished, _MAKE, 0o600, dir_fd=folder)
    try:
        with open(descriptor, "wb") as file:
            file.write(content)
        os.replace(unfinished, name, src_dir_fd=folder, dst_dir_fd=folder)
    except BaseException:
        os.unlink(unfinished, dir_fd=folder)
        raise


def _warn(error: Untrusted) -> None:
    from pipros.warn_once import warn_once

    warn_once(
        f"WARNING: a cache of pipros is not used: {error}. Other users could choose there what your programs "
        "run. Remove it, or set ROS_HOME to a folder of your own"
    )
