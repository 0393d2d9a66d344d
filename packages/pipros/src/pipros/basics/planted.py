"""Refuse paths by which another user may choose what this one writes, or make it wait."""

from __future__ import annotations

import errno
import os
from stat import S_ISDIR, S_ISLNK, S_ISREG, S_IWOTH

from pipros.basics.posix import HAS_OWNERS, user_id

_ROOT = 0
_LINKS_FOLLOWED = 40


class UntrustedFile(PermissionError):
    """The output path is unsafe: another user could have placed a file or link there."""


def refuse_planted(path: str | os.PathLike[str]) -> None:
    """Refuse another user's link, anywhere on the path, or pipe at its end, in a folder that all may write.

    Linux's `protected_symlinks`, if it is on, asks only for the last name. As there, what belongs to this
    user or to the folder's owner is followed, and also what belongs to root.

    Raises:
        UntrustedFile: such a link or pipe was found. The file name is `path`.
    """
    if not HAS_OWNERS:
        return
    named = os.fspath(path)
    folder, names, links = "/" if os.path.isabs(named) else "", named.split("/")[::-1], 0
    while names and links <= _LINKS_FOLLOWED:
        place = os.path.join(folder, names.pop())
        try:
            status = os.lstat(place)
        except (OSError, ValueError):  # it does not exist yet, or cannot be written either
            return
        if not S_ISREG(status.st_mode) and not S_ISDIR(status.st_mode):
            _check_owner(status, place, folder, named)
        if S_ISLNK(status.st_mode):
            links += 1
            target = os.readlink(place)
            names += target.split("/")[::-1]
            place = "/" if target.startswith("/") else folder
        folder = place


def open_unplanted(path: str, flags: int) -> int:
    """Open a file to write, for `opener` of `open`; see `refuse_planted`."""
    refuse_planted(path)
    return os.open(path, flags, 0o666)


def _check_owner(status: os.stat_result, place: str, folder: str, named: str) -> None:
    above = os.stat(folder or ".")
    if above.st_mode & S_IWOTH and status.st_uid not in (user_id(), above.st_uid, _ROOT):
        kind = "link" if S_ISLNK(status.st_mode) else "pipe or device"
        reason = f"[{place}] is a {kind} of another user ({status.st_uid}) in a folder that all may write"
        raise UntrustedFile(errno.EACCES, f"{reason}: remove it, or name another path", named)
