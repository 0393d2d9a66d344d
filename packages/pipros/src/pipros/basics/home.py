"""Find the current user's home folder, with a fallback for users who do not have one.

An example is a container user whose ID has no entry in `/etc/passwd`. For such users, genuine ROS creates a
folder named `~` in the working directory.
"""

from __future__ import annotations

import os
from contextlib import suppress
from functools import cache
from stat import S_ISDIR

from pipros.basics.posix import HAS_OWNERS, user_id


def expanded(path: str) -> str:
    """Return the path with a leading `~` or `~name` replaced by that user's home folder.

    Never raises, unlike `Path.expanduser`.
    """
    found = os.path.expanduser(path)
    if found == "~" or found.startswith("~/"):
        return fallback_home() + found[1:]
    return found


@cache
def fallback_home() -> str:
    """Return a private folder for this user in the temporary folder, the same in every process if possible.

    Never raises. If the folder cannot be created, using files in it will fail.
    """
    import tempfile

    name = f"pipros-home-{user_id() if HAS_OWNERS else 'user'}"
    try:
        folder = os.path.join(tempfile.gettempdir(), name)
        with suppress(FileExistsError):
            os.mkdir(folder, 0o700)
        if _is_mine_alone(folder):
            return folder
        private = tempfile.mkdtemp(prefix=f"{name}-")
    except OSError:
        return os.path.join(os.sep, "tmp", name)
    from pipros.basics.warn_once import warn_once

    warn_once(
        f"WARNING: HOME is not set, and another user could have created {folder}. ROS files go to {private}; "
        "set HOME or ROS_HOME"
    )
    return private


def _is_mine_alone(folder: str) -> bool:
    status = os.lstat(folder)
    return S_ISDIR(status.st_mode) and (
        not HAS_OWNERS or (status.st_uid == user_id() and not status.st_mode & 0o022)
    )
