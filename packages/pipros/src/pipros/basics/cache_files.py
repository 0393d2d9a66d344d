"""Cache files, in a folder to which only this user can write.

The files determine which programs run, and some contain code, so a file that another user could have written
is not used. This module imports little, because the first message import of each process loads it.
"""

from __future__ import annotations

import errno
import os
from stat import S_ISDIR, S_ISREG

from pipros.basics.posix import HAS_OWNERS, NO_LINK, READ, user_id
from pipros.basics.windows import replace_file

_OTHERS_MAY_WRITE = 0o022
_READ = READ | NO_LINK
_MAKE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | NO_LINK | getattr(os, "O_BINARY", 0)
_ENTER = os.O_RDONLY | NO_LINK | getattr(os, "O_DIRECTORY", 0)


class Untrusted(PermissionError):
    """Another user could have written a file, or could write files to a folder."""


class CacheFolder:
    """A folder of cache files without subfolders.

    The folder and its parent must belong to this user, must not be writable by others, and must not be
    symbolic links. The same applies to each file that is read, which also must not have additional hard
    links. Folders further up may be links and may belong to other users, who could replace those folders, but
    cannot create folders that belong to this user. If a check fails, the cache is not used, and a warning is
    printed once. A missing, full or read-only cache is ignored. Methods that document errors raise instead.

    Files are replaced atomically, so any number of processes may share the folder.
    """

    __slots__ = ("_path",)

    def __init__(self, path: str) -> None:
        self._path = os.path.abspath(path)

    def read(self, name: str) -> bytes | None:
        """Return the content of a file, or None if the file is missing, unreadable or not trusted."""
        try:
            return self.load(name)
        except Untrusted as error:
            _warn(error)
        except OSError:
            pass
        return None

    def write(self, name: str, content: bytes) -> None:
        """Create or replace a file that only this user can read, if possible."""
        try:
            self.store(name, content)
        except Untrusted as error:
            _warn(error)
        except OSError:
            pass

    def load(self, name: str) -> bytes:
        """Return the content of a file.

        Raises:
            Untrusted: another user could have written the file.
            OSError: the file cannot be read.
        """
        if not HAS_OWNERS:
            return _read_plain(os.path.join(self._path, name))
        folder = self.enter()
        try:
            return _read_own(name, folder, self._path)
        finally:
            os.close(folder)

    def store(self, name: str, content: bytes) -> None:
        """Create or replace a file that only this user can read.

        Raises:
            Untrusted: another user could write to the folder.
            OSError: the file cannot be written. Its file name is the path of the file.
        """
        unfinished, path = f".{name}.{os.urandom(6).hex()}", os.path.join(self._path, name)
        self._make()
        folder = self.enter() if HAS_OWNERS else None
        try:
            if folder is None:
                _replace(os.path.join(self._path, unfinished), path, content, None)
            else:
                _replace(unfinished, name, content, folder)
        except OSError as error:
            raise OSError(error.errno, error.strerror, path) from None
        finally:
            if folder is not None:
                os.close(folder)

    def names(self) -> list[str]:
        """Return the names of all files, except unfinished files.

        Raises:
            Untrusted: another user could write to the folder.
            OSError: the folder cannot be read.
        """
        if not HAS_OWNERS:
            found = os.listdir(self._path)
        else:
            folder = self.enter()
            try:
                found = os.listdir(folder)
            finally:
                os.close(folder)
        return [name for name in found if not name.startswith(".")]

    def remove(self, name: str) -> None:
        """Remove a file.

        Raises:
            Untrusted: another user could write to the folder.
            OSError: the file cannot be removed.
        """
        if not HAS_OWNERS:
            os.unlink(os.path.join(self._path, name))
            return
        folder = self.enter()
        try:
            os.unlink(name, dir_fd=folder)
        finally:
            os.close(folder)

    def enter(self, *, creates: bool = False) -> int:
        """Return a file descriptor for the folder, which the caller must close. Requires a POSIX system.

        Args:
            creates: whether to create the folder if it does not exist.

        Raises:
            Untrusted: another user could have created the folder or its parent.
            OSError: the folder cannot be created or opened.
        """
        if creates:
            self._make()
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
        # Create nothing in another user's folder: root would leave files there that its owner cannot use.
        if missing and HAS_OWNERS and os.stat(folder).st_uid != user_id():
            raise PermissionError(f"{folder} belongs to another user")
        for path in reversed(missing):
            try:  # without contextlib.suppress, because importing contextlib takes time
                os.mkdir(path, 0o700)
            except FileExistsError:  # another process has just created it
                continue


def _enter(name: str, above: int | None, path: str) -> int:
    try:
        folder = os.open(name, _ENTER, dir_fd=above)
    except OSError as error:
        # The error for a link opened with O_NOFOLLOW and O_DIRECTORY differs between systems.
        if error.errno in (errno.ELOOP, errno.ENOTDIR, errno.EMLINK) and os.path.lexists(path):
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
        if status.st_nlink > 1:  # a link count of 0 means that another process has just replaced the file
            raise Untrusted(f"{path} must not have additional hard links")
        check_owner(status, path)
        return file.readall()


def check_owner(status: os.stat_result, path: str) -> None:
    """Raise `Untrusted` unless a file or folder belongs to this user and no other user can write to it."""
    if status.st_uid != user_id():
        raise Untrusted(f"{path} belongs to another user (uid {status.st_uid})")
    if status.st_mode & _OTHERS_MAY_WRITE:
        raise Untrusted(f"{path} must not be writable by other users")


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
        if folder is None:
            replace_file(unfinished, name)
        else:
            os.replace(unfinished, name, src_dir_fd=folder, dst_dir_fd=folder)
    except BaseException:
        os.unlink(unfinished, dir_fd=folder)
        raise


def _warn(error: Untrusted) -> None:
    from pipros.basics.warn_once import warn_once

    warn_once(
        f"WARNING: a pipros cache is not used: {error}. Other users could put code there that your "
        "programs run. Remove the cache, or set ROS_HOME to your own folder"
    )
