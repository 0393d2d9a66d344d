"""The home folder of this user, also where none is known: a container with a user number and nothing more.

Genuine ROS makes a folder named `~` in the working folder then.
"""

from __future__ import annotations

import os
from contextlib import suppress
from functools import cache
from stat import S_ISDIR


def expanded(path: str) -> str:
    """The path with the home folder for a leading `~`, and that of another user for `~name`, if there is one.

    Never raises, unlike `Path.expanduser`.
    """
    found = os.path.expanduser(path)
    if found == "~" or found.startswith("~/"):
        return fallback_home() + found[1:]
    return found


@cache
def fallback_home() -> str:
    """A folder for this user alone in the temporary folder; the same one in every process, if it can be had.

    Never raises: where no folder can be made, each file that is wanted there will say so by itself.
    """
    import tempfile

    name = f"pipros-home-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    try:
        folder = os.path.join(tempfile.gettempdir(), name)
        with suppress(FileExistsError):
            os.mkdir(folder, 0o700)
        if _is_mine_alone(folder):
            return folder
        own = tempfile.mkdtemp(prefix=f"{name}-")
    except OSError:
        return os.path.join(os.sep, "tmp", name)
    from pipros.warn_once import warn_once

    warn_once(
        f"WARNING: HOME is not set, and {folder} could be another user's work. Files of ROS go to {own}; "
        "set HOME or ROS_HOME"
    )
    return own


def _is_mine_alone(folder: str) -> bool:
    status = os.lstat(folder)
    return S_ISDIR(status.st_mode) and (
        not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o022)
    )
